"""Views of a camera whose pictures were taken between frames."""

from dataclasses import replace

import numpy as np
import pytest

from app.drawing import joint_handles, overlays
from app.drawing.pin_marks import pin_marks
from app.state.page_view import View
from app.state.people import ShownPose
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.footage.camera_source import Clock
from tracker.geometry.triangulation import PointObservation
from tracker.interchange.exports.keypoints import keypoints_in_views
from tracker.session.session import load_session

LATE = 1


@pytest.fixture
def late(session):
    """A session one camera of which is late by half a frame, drifting, and a person who moves."""
    loaded = load_session(session)
    cameras = [replace(c, clock=Clock(0.4, 0.05)) if i == LATE else c for i, c in enumerate(loaded.cameras)]
    model = loaded.people[0].model
    pose, velocity = model.neutral(), np.zeros(model.n_dofs)
    pose[:3], velocity[0] = (0.0, 0.0, 1.0), 0.1
    state = State(frame=2, people=(ShownPose(pose, "manual"),), velocities=(velocity,))
    return replace(loaded, cameras=tuple(cameras)), state


def places(session, state):
    handles = joint_handles.handles(session, state, range(len(session.cameras)))
    return {i: np.array([(h.u, h.v) for h in handles if h.camera == i]) for i in range(len(session.cameras))}


def test_joints_are_drawn_where_the_picture_shows_them(late):
    session, state = late
    moved = state.poses[0].copy()
    moved[0] += 0.05  # 0.4 + 2 * 0.05 frames at 0.1 m a frame
    drawn, still, then = (
        places(session, s)
        for s in (state, replace(state, velocities=()), replace(state, people=(ShownPose(moved, ""),), velocities=()))
    )
    for i in drawn:
        np.testing.assert_allclose(drawn[i], (then if i == LATE else still)[i], atol=1e-9)
    assert np.abs(drawn[LATE] - still[LATE]).max() > 1


def test_contours_and_pins_follow(late):
    session, state = late
    view = View(frozenset(["contours"]), (1,) * len(session.cameras))
    state = replace(state, pins=((PointObservation("head", LATE, (5.0, 5.0)),),))
    still = replace(state, velocities=())
    for i in range(len(session.cameras)):
        lines = [
            np.concatenate([p.segments_px for p in overlays.paths(session, s, view, None) if p.camera == i])
            for s in (state, still)
        ]
        assert (lines[0].shape != lines[1].shape or np.abs(lines[0] - lines[1]).max() > 0.5) == (i == LATE)
    (mark,), (unmoved,) = pin_marks(session, state), pin_marks(session, still)
    assert abs(mark.model_u - unmoved.model_u) > 1


def test_exported_keypoints_are_those_of_the_picture(late):
    session, state = late
    body = PosedBody(session.people[0].model, state.poses[0], state.velocities[0])
    cameras = [c.camera for c in session.cameras]
    times = [c.clock.offset_frames(state.frame) for c in session.cameras]
    found, plain = keypoints_in_views([body], cameras, times), keypoints_in_views([body], cameras)
    (then,) = keypoints_in_views([body.ahead(0.5)], [cameras[LATE]])
    np.testing.assert_allclose(found[LATE][0].points_px, then[0].points_px)
    np.testing.assert_allclose(found[0][0].points_px, plain[0][0].points_px)
