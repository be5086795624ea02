"""The mass of the paths on which a limb is elsewhere, with each view left out in turn."""

import numpy as np
import pytest

from tracker.body.limbs import limbs
from tracker.estimation.runs.path_assessment import compared
from tracker.estimation.trajectory.hypotheses import HypothesisSet, Paths
from tracker.estimation.trajectory.motion_model import acceleration, motion_points


def frame(model, poses, view_nats, prior_nats=None):
    places = np.array([motion_points(model).at(model.kinematics(pose)) for pose in poses])
    prior = np.zeros(len(poses)) if prior_nats is None else np.array(prior_nats)
    return HypothesisSet(np.array(poses), places, np.array(view_nats, float), prior, ("",) * len(poses))


def masses(model, sets, poses):
    paths = Paths(acceleration(np.arange(len(sets)) / 25.0), motion_points(model).groups)
    return compared(model, paths, sets, np.array(poses))[0]


@pytest.fixture
def raised(gavrila):
    """The pose, the same with the left arm raised, and with it raised a little."""
    pose, at = gavrila.neutral(), gavrila.value_names.index("left_shoulder.elevation")
    return pose, *(pose + by * (np.arange(len(pose)) == at) for by in (1.0, 0.05))


def of_arm(model, mass):
    return [mass if x.name == "left_forearm" else 0.0 for x in limbs(model)]


def test_each_view_is_left_out_in_turn(gavrila, raised):
    here, other, _ = raised
    nats = np.array([[0.0, 1.0, 3.0], [2.0, 0.5, 0.0]])
    (found,) = masses(gavrila, [frame(gavrila, [here, other], nats, (0.0, 0.25))], [here])
    without = [nats.sum(axis=1) - nats[:, v] + (0.0, 0.25) for v in range(3)]
    expected = np.mean([np.exp(-c[1]) / np.exp(-c).sum() for c in without])
    assert found == pytest.approx(of_arm(gavrila, expected))


def test_of_two_views_none_is_left_out(gavrila, raised):
    here, other, _ = raised
    (found,) = masses(gavrila, [frame(gavrila, [here, other], [[0.0, 1.0], [2.0, 0.5]])], [here])
    assert found == pytest.approx(of_arm(gavrila, 1 / (1 + np.exp(1.5))))


def test_a_view_that_alone_holds_a_limb_does_not_hide_what_the_others_say(gavrila, raised):
    here, other, _ = raised
    (found,) = masses(gavrila, [frame(gavrila, [here, other], [[0.0, 9.0, 9.0, 9.0], [50.0, 0.0, 0.0, 0.0]])], [here])
    assert found == pytest.approx(of_arm(gavrila, 0.25), abs=1e-6)


def test_nearly_the_same_pose_is_not_elsewhere(gavrila, raised):
    here, other, near = raised
    (found,) = masses(gavrila, [frame(gavrila, [here, near], np.zeros((2, 3)))], [here])
    assert not found.any()
    (found,) = masses(gavrila, [frame(gavrila, [here, near], np.zeros((2, 3)))], [other])
    assert found == pytest.approx(of_arm(gavrila, 1.0))


def test_motion_tells_hypotheses_of_a_frame_apart(gavrila, raised):
    """The arm would leap there and back."""
    here, other, _ = raised
    sets = [
        frame(gavrila, [here, other], np.zeros((2, 3))) if t == 4 else frame(gavrila, [here], np.zeros((1, 3)))
        for t in range(9)
    ]
    paths = Paths(acceleration(np.arange(9) / 25.0), motion_points(gavrila).groups)
    even = compared(gavrila, paths, sets, np.array([here] * 9))[0]
    assert even[4] == pytest.approx(of_arm(gavrila, 0.5))
    paths.likeliest(sets)
    moved = compared(gavrila, paths, sets, np.array([here] * 9))[0]
    assert moved[4].max() < 1e-3


def test_poses_that_the_evidence_without_a_view_prefers_are_kept(gavrila, raised):
    """They are about as good only without the first view. A pose that no view prefers is not kept."""
    here, other, near = raised
    nats = [[0.0, 9.0, 9.0], [50.0, 0.0, 0.0], [0.0, 9.0, 9.1]]
    sets = [frame(gavrila, [here, other, near], nats), frame(gavrila, [here, other], [[0.0] * 3, [20.0] * 3])]
    paths = Paths(acceleration(np.arange(2) / 25.0), motion_points(gavrila).groups)
    _, (first, second) = compared(gavrila, paths, sets, np.array([here, here]))
    assert [(h.pose.tobytes(), h.cost) for h in first] == [(other.tobytes(), 50.0)]
    assert second == ()
