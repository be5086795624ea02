"""What is drawn over the views, against evidence made by hand and that of the sample."""

from dataclasses import replace

import numpy as np
import pytest

from app.drawing import overlays
from app.drawing.overlays import Path
from app.state.page_view import View
from app.state.people import ShownPose
from tracker.body.model import PosedBody
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.images.edge_segments import EdgeSegments, sample_segments


def kinds_of(paths, kind, camera=0):
    return [p for p in paths if p.kind == kind and p.camera == camera]


@pytest.fixture
def controller(opened):
    return opened()


def view_of(*layers, **changes):
    return View(**{"layers": frozenset(layers), "reductions": (1, 1, 1, 1)} | changes)


SEGMENTS = view_of("accepted", "rejected")


def drawn(controller, state, views=None, view=SEGMENTS):
    views = controller.frames.cached_evidence(state.frame) if views is None else views
    return overlays.paths(controller.session, state, view, views)


def test_segments_are_drawn_only_with_their_layer_and_their_evidence(controller):
    state = controller.state
    assert kinds_of(drawn(controller, state), "rejected")
    assert not kinds_of(overlays.paths(controller.session, state, SEGMENTS, None), "rejected")
    assert not kinds_of(drawn(controller, state, view=view_of("contours")), "rejected")
    assert {p.kind for p in drawn(controller, state, view=view_of("accepted"))} == {"accepted"}


def test_a_body_accepts_the_edges_along_it_and_no_others(controller):
    state = controller.state

    def counts(shift_m):
        values = state.poses[0] + shift_m * (np.arange(22) == 0)
        paths = drawn(controller, replace(state, people=(ShownPose(values, "manual"),)))
        return [sum(len(p.segments_px) for p in paths if p.kind == kind) for kind in ("accepted", "rejected")]

    (near, left), (away, all_left) = counts(0.0), counts(3.0)
    assert near > 100
    assert away == 0
    assert near + left == all_left


def test_segments_lie_in_undistorted_pixels_of_the_whole_image(controller):
    """A region at half size: its pixel (u, v) covers pixels 2 (u + corner) and the next."""
    points = np.array([[4, 6], [5, 6], [6, 6], [7, 6], [20, 30], [20, 31]], np.float32)
    normals = np.tile(np.float32([0, 1]), (6, 1))
    segments = EdgeSegments(points, normals, np.array([0, 4, 6]))
    camera = controller.session.cameras[0].camera.pinhole.scaled(0.5).cropped((10, 20, 60, 70))
    view = ViewEvidence(
        camera,
        0.5,
        np.empty((0, 2), np.float32),
        np.empty((50, 50), np.float32),
        (10, 20),
        segments=segments,
        samples=sample_segments(segments),
    )
    paths = drawn(controller, controller.state, [view] * 4)
    lines = np.concatenate([p.segments_px for p in paths if p.camera == 0])
    expected = [[28.5, 52.5, 34.5, 52.5], [60.5, 100.5, 60.5, 102.5]]  # the ends of each, and nothing between the two
    np.testing.assert_allclose(lines[np.argsort(lines[:, 0])], expected)
    assert {type(p) for p in paths} == {Path}


def test_visible_and_hidden_contours_are_what_the_tracing_says(controller):
    state, session = controller.state, controller.session
    traced = occluding_contours.trace(
        [PosedBody(session.people[0].model, state.poses[0])], session.cameras[1].camera.pinhole
    )
    assert 0 < traced.occluded.sum() < len(traced.occluded)
    paths = drawn(controller, state, view=view_of("contours", "hidden"))
    for kind, those in (("hidden", traced.occluded), ("model", ~traced.occluded)):
        (path,) = kinds_of(paths, kind, camera=1)
        np.testing.assert_array_equal(path.segments_px, traced.pieces_px[those])
        assert path.color == session.people[0].color
    assert {p.kind for p in drawn(controller, state, view=view_of("hidden"))} == {"hidden"}


def test_contours_by_part_are_the_same_pieces_in_the_parts_colours(controller):
    state, parts = controller.state, controller.session.people[0].model.parts
    (whole,) = kinds_of(drawn(controller, state, view=view_of("contours")), "model")
    by_part = kinds_of(drawn(controller, state, view=view_of("contours", by_part=True)), "model")
    np.testing.assert_array_equal(np.concatenate([p.segments_px for p in by_part]), whole.segments_px)
    assert len(by_part) > 5
    assert {p.color for p in by_part} <= {part.color for part in parts}


def test_only_the_views_that_a_page_sees_are_drawn(controller):
    seen = view_of("contours", "accepted", reductions=(0, 0, 2, 0))
    assert {p.camera for p in drawn(controller, controller.state, view=seen)} == {2}
    assert {h.camera for h in overlays.handles(controller.session, controller.state, seen.cameras)} == {2}
