"""What is drawn over the views, against evidence made by hand and that of the sample."""

from dataclasses import replace

import numpy as np
import pytest

from app.drawing import joint_handles, overlays
from app.drawing.overlays import Path
from app.state.page_view import View
from app.state.people import ShownPose
from tracker.body.model import PosedBody
from tracker.evidence.contours import occluding_contours, part_edges
from tracker.evidence.images.edge_segments import EdgeSegments, sample_segments
from tracker.evidence.view_evidence import ViewEvidence


def kinds_of(paths, kind, camera=0):
    return [p for p in paths if p.kind == kind and p.camera == camera]


def view_of(*layers, **changes):
    return View(**{"layers": frozenset(layers), "reductions": (1, 1, 1, 1)} | changes)


SEGMENTS = view_of("accepted", "rejected")


def drawn(controller, state, views=None, view=SEGMENTS):
    views = controller.frames.cached_evidence(state.frame) if views is None else views
    return overlays.paths(controller.session, state, view, views)


@pytest.mark.slow
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


def rows_sorted(segments_px):
    """Pieces of several paths in one order."""
    rows = np.concatenate(segments_px)
    return rows[np.lexsort(rows.T)]


def traced_in_second_view(controller):
    body = PosedBody(controller.session.people[0].model, controller.state.poses[0])
    return occluding_contours.trace([body], controller.session.cameras[1].camera.pinhole)


def test_visible_and_hidden_contours_are_what_the_tracing_says(controller):
    state, session, traced = controller.state, controller.session, traced_in_second_view(controller)
    assert 0 < traced.occluded.sum() < len(traced.occluded)
    paths = drawn(controller, state, view=view_of("contours", "hidden"))
    for kind, those in (("hidden", traced.occluded), ("model", ~traced.occluded)):
        kinds = kinds_of(paths, kind, camera=1)
        np.testing.assert_array_equal(
            rows_sorted([p.segments_px for p in kinds]), rows_sorted([traced.pieces_px[those]])
        )
        assert {p.color for p in kinds} == {session.people[0].color}
    assert {p.kind for p in drawn(controller, state, view=view_of("hidden"))} == {"hidden"}


def test_contours_by_part_are_the_same_pieces_in_the_parts_colours(controller):
    state, parts = controller.state, controller.session.people[0].model.parts
    by_person = kinds_of(drawn(controller, state, view=view_of("contours")), "model")
    by_part = kinds_of(drawn(controller, state, view=view_of("contours", by_part=True)), "model")
    pieces = [rows_sorted([p.segments_px for p in paths]) for paths in (by_person, by_part)]
    np.testing.assert_array_equal(*pieces)
    assert len(by_part) > 5
    assert {p.color for p in by_part} <= {part.color for part in parts}


@pytest.mark.parametrize("by_part", [False, True])
def test_each_contour_names_its_side(controller, by_part):
    state, session, traced = controller.state, controller.session, traced_in_second_view(controller)
    names = np.array([part.name for part in session.people[0].model.parts])[traced.parts[~traced.occluded]]
    paths = kinds_of(drawn(controller, state, view=view_of("contours", by_part=by_part)), "model", camera=1)
    for side in ("left", "right"):
        expected = traced.pieces_px[~traced.occluded][[name.startswith(side) for name in names]]
        found = [p.segments_px for p in paths if p.side == side]
        np.testing.assert_array_equal(rows_sorted(found), rows_sorted([expected]))
    handles = joint_handles.handles(session, state, [1])
    assert {h.point: h.side for h in handles if h.point.endswith("knee")} == {
        "left_knee": "left",
        "right_knee": "right",
    }


def test_the_head_shows_where_it_faces(controller):
    """The sample's person faces the first camera: the arrow comes towards it, and points away from the one behind."""
    state, session = controller.state, controller.session
    body = PosedBody(session.people[0].model, state.poses[0])
    forward = body.kinematics.Ts_world_part[body.model.part_index["head"], :3, 0]
    paths = drawn(controller, state, view=view_of("contours"))
    kinds = set()
    for index, source in enumerate(session.cameras):
        (arrow,) = [p for p in paths if p.camera == index and p.kind.startswith("facing")]
        is_away = forward @ source.camera.T_world_camera[:3, 2] > 0
        assert arrow.kind == ("facing_away" if is_away else "facing")
        kinds.add(arrow.kind)
        shaft = np.diff(arrow.segments_px[0].reshape(2, 2), axis=0)[0]
        head = body.points_world[body.model.point_names.index("head")]
        seen = source.camera.pinhole.project(np.stack([head, head + 0.01 * forward]))
        assert shaft @ (seen[1] - seen[0]) > 0
    assert kinds == {"facing", "facing_away"}


def test_only_the_views_that_a_page_sees_are_drawn(controller):
    seen = view_of("contours", "accepted", reductions=(0, 0, 2, 0))
    assert {p.camera for p in drawn(controller, controller.state, view=seen)} == {2}
    assert {h.camera for h in joint_handles.handles(controller.session, controller.state, seen.cameras)} == {2}


def test_a_joint_behind_another_person_says_by_whom_it_is_hidden(couple):
    state, camera = couple.state, couple.session.cameras[0].camera.pinhole
    ann = state.people[0].values
    bob = ann.copy()
    to_camera = camera.center_world - ann[:3]
    bob[:3] += 0.7 * to_camera / np.linalg.norm(to_camera)
    state = replace(state, people=(ShownPose(ann, "manual"), ShownPose(bob, "manual")))
    alone = joint_handles.handles(couple.session, replace(state, people=(state.people[0], couple.state.people[1])), [0])
    visible = {h.point for h in alone if h.person == 0 and h.visible}
    handles = joint_handles.handles(couple.session, state, [0])
    assert {h.hidden_by for h in handles if h.person == 0 and h.point in visible and not h.visible} == {1}
    assert [h for h in handles if h.person == 0 and h.point in visible and not h.visible]
    assert {h.hidden_by for h in handles if h.person == 1} == {None}
    assert {h.hidden_by for h in handles if h.visible} == {None}


def test_joints_are_tested_once_against_each_body_in_the_visible_views(couple, monkeypatch):
    """With eight people and sixteen cameras, a test of each pair of people took most of a seek."""
    occluded, tested = part_edges._occluded_points, []
    monkeypatch.setattr(part_edges, "_occluded_points", lambda *args: (tested.append(args[0].name), occluded(*args))[1])
    cameras = [c.camera for c in couple.session.cameras]
    names, values = [c.name for c in cameras], couple.state.poses[0]
    behind = values.copy()
    behind[:3] += 0.6 * cameras[0].T_world_camera[:3, 2]  # of the first in this view
    state = replace(couple.state, people=(ShownPose(values, "manual"), ShownPose(behind, "manual")))
    handles = joint_handles.handles(couple.session, state, {0, 2})
    assert sorted(tested) == sorted(2 * [names[0], names[2]])
    assert {h.camera for h in handles} == {0, 2}
    assert {(h.person, h.hidden_by) for h in handles if h.camera == 0 and not h.visible} >= {
        (0, None),
        (1, None),
        (1, 0),
    }
