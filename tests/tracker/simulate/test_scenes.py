import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.simulate.scenes import HEADING_RAD, SCENES, cast_of, perform

FPS = 25.0


def points_of(model, poses):
    points = np.array([model.points_world(v) for v in poses])
    return {name: points[:, i] for i, name in enumerate(model.point_names)}


def degrees(model, poses, name):
    return np.degrees(poses[:, model.dof_names.index(name)])


@pytest.mark.parametrize("scene", SCENES)
def test_poses_keep_the_limits_and_move_smoothly(scene, true_model):
    (role,) = cast_of(scene)
    poses = perform(role, true_model, 120, FPS)
    for values in poses:
        assert np.allclose(values, true_model.clip(values))
    assert np.abs(np.diff(poses[:, 3:], axis=0)).max() < np.radians(18)
    assert np.abs(np.diff(poses[:, :3], axis=0)).max() < 0.02


def test_elbow_rotation_raises_the_arms_then_turns_the_elbows_forward(true_model):
    poses = perform(cast_of("elbow_rotation")[0], true_model, 50, FPS)
    points = points_of(true_model, poses)
    for side, left in (("left", 1.0), ("right", -1.0)):
        abduction = degrees(true_model, poses, f"{side}_shoulder.abduction")
        extension = degrees(true_model, poses, f"{side}_elbow.extension")
        assert abduction[0] < 15
        assert np.isclose(abduction[25:].max(), 90, atol=1)
        assert extension[:24].max() < 15
        assert extension[-1] > 90
        twist = poses[-1, true_model.dof_names.index("torso.twist")]
        ahead, aside = np.array([np.cos(twist), np.sin(twist)]), np.array([-np.sin(twist), np.cos(twist)])
        upper = (points[f"{side}_elbow"] - points[f"{side}_shoulder"])[-1]
        fore = (points[f"{side}_wrist"] - points[f"{side}_elbow"])[-1]
        assert upper[:2] @ (left * aside) > 0.95 * np.linalg.norm(upper)
        assert fore[:2] @ ahead > 0.95 * np.linalg.norm(fore)
    # The trunk leans back against the arms.
    lean = (points["neck"] - points["torso"]) @ np.append(ahead, 0.0)
    assert lean[-1] < lean[22] - 0.01


def test_standing_feet_stay_where_they_are(true_model):
    points = points_of(true_model, perform(cast_of("elbow_rotation")[0], true_model, 50, FPS))
    for ankle in ("left_ankle", "right_ankle"):
        assert np.abs(points[ankle] - points[ankle][0]).max() < 1e-3
    # Side by side under the trunk, whichever way the person faces.
    to_left = (points["left_ankle"] - points["right_ankle"])[0, :2]
    assert to_left @ (-np.sin(HEADING_RAD), np.cos(HEADING_RAD)) > 0.98 * np.linalg.norm(to_left)


def test_walking_lifts_the_knees_in_turn_and_swings_the_arms(true_model):
    poses = perform(cast_of("walk_in_place")[0], true_model, 100, FPS)
    points = points_of(true_model, poses)
    left, right = (points[f"{side}_ankle"][:, 2] - points[f"{side}_ankle"][0, 2] for side in ("left", "right"))
    assert left.max() > 0.1
    assert right.max() > 0.1
    assert np.minimum(left, right).max() < 1e-3
    for dof in ("left_shoulder.elevation", "right_shoulder.elevation"):
        assert np.ptp(degrees(true_model, poses, dof)) > 40


def test_an_unknown_scene_lists_those_there_are():
    with pytest.raises(TrackerError, match=r"elbow_rotation.*'tango_solo'"):
        cast_of("tango_solo")
