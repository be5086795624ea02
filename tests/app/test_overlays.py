"""What is drawn over the views, against evidence made by hand and that of the sample."""

from dataclasses import replace

import numpy as np
import pytest

from app import overlays
from app.overlays import Path
from app.state import Shown
from tracker.evidence import ViewEvidence
from tracker.segments import Segments


def kinds_of(paths, kind, camera=0):
    return [p for p in paths if p.kind == kind and p.camera == camera]


@pytest.fixture
def controller(opened):
    controller = opened()
    controller.set_view("image", {"segments": True})
    return controller


def drawn(controller, state, views=None):
    views = controller.frames.evidence_at_hand(state.frame) if views is None else views
    return overlays.paths(controller.session, state, views)


def test_segments_are_drawn_only_with_their_layer_and_their_evidence(controller):
    state = controller.state
    assert kinds_of(drawn(controller, state), "rejected")
    assert not kinds_of(overlays.paths(controller.session, state, None), "rejected")
    off = replace(state, overlays=frozenset(("contours",)))
    assert not kinds_of(drawn(controller, off), "rejected")


def test_a_body_accepts_the_edges_along_it_and_no_others(controller):
    state = controller.state

    def counts(shift_m):
        values = state.poses[0] + shift_m * (np.arange(22) == 0)
        paths = drawn(controller, replace(state, people=(Shown(values, "manual"),)))
        return [sum(len(p.segments_px) for p in paths if p.kind == kind) for kind in ("accepted", "rejected")]

    (near, left), (away, all_left) = counts(0.0), counts(3.0)
    assert near > 100
    assert away == 0
    assert near + left == all_left


def test_segments_lie_in_undistorted_pixels_of_the_whole_image(controller):
    """A region at half size: its pixel (u, v) covers pixels 2 (u + corner) and the next."""
    points = np.array([[4, 6], [5, 6], [6, 6], [7, 6], [20, 30], [20, 31]], np.float32)
    normals = np.tile(np.float32([0, 1]), (6, 1))
    segments = Segments(points, normals, np.array([0, 4, 6]))
    camera = controller.session.cameras[0].camera.pinhole.scaled(0.5).cropped((10, 20, 60, 70))
    view = ViewEvidence(
        camera, 0.5, np.empty((0, 2), np.float32), np.empty((50, 50), np.float32), (10, 20), segments=segments
    )
    state = replace(controller.state, overlays=frozenset(("segments",)))
    paths = drawn(controller, state, [view] * 4)
    lines = np.concatenate([p.segments_px for p in paths if p.camera == 0])
    expected = [[28.5, 52.5, 34.5, 52.5], [60.5, 100.5, 60.5, 102.5]]  # the ends of each, and nothing between the two
    np.testing.assert_allclose(lines[np.argsort(lines[:, 0])], expected)
    assert {type(p) for p in paths} == {Path}
