from dataclasses import replace

import numpy as np
import pytest
from staging import camera_at, cameras_around

from tracker.body.dimensions import standing_extent_m
from tracker.estimation.posing.default_pose import default_pose
from tracker.geometry import rigid
from tracker.geometry.ground_plane import UP_ROTATIONS, GroundPlane


def place(model, values, point):
    return model.points_world(values)[model.point_names.index(point)]


@pytest.mark.slow
@pytest.mark.parametrize("up", list(UP_ROTATIONS))
def test_standing_pose(gavrila, up):
    """The default pose is upright along the up axis, where the cameras look, for any axes of the world."""
    R, center = UP_ROTATIONS[up], np.array([1.0, 2.0, 3.0])
    T = rigid.transform(R, center)
    cameras = [
        camera_at(c.name, c.center_world, (0, 0, 0)) for c in cameras_around(3)
    ]  # they look at the origin of a world whose up is z
    turned = [_moved(c, T) for c in cameras]
    values = default_pose(gavrila, turned, UP_ROTATIONS[up])
    np.testing.assert_allclose(place(gavrila, values, "torso"), center, atol=0.02)
    axis = np.array([{"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[up[-1]]])[0] * (-1 if up[0] == "-" else 1)
    points = dict(zip(gavrila.point_names, gavrila.points_world(values) @ axis, strict=True))
    assert points["head"] > points["left_shoulder"] > points["torso"] > points["left_knee"] > points["left_ankle"]
    assert points["head"] - points["left_ankle"] == pytest.approx(
        np.ptp(gavrila.points_world(gavrila.neutral())[:, 2]), abs=0.01
    )
    np.testing.assert_allclose(gavrila.clip(values), values, atol=1e-9)


def _moved(camera, T_new_world):
    return replace(camera, T_world_camera=T_new_world @ camera.T_world_camera)


def test_standing_pose_before_a_single_camera(gavrila):
    camera = camera_at("only", (1.0, 0.0, 1.0), (2.0, 0.0, 1.0))
    values = default_pose(gavrila, [camera])
    np.testing.assert_allclose(place(gavrila, values, "torso"), [5.0, 0.0, 1.0], atol=0.01)  # 4 m in front


@pytest.mark.parametrize("floor_m", [0.4, 0.8])
def test_a_body_stands_on_a_floor_that_lies_below_the_cameras(gavrila, floor_m):
    """Cameras at 0.6 m look at the origin: a floor above them is none, and the root is where they look."""
    values = default_pose(gavrila, cameras_around(3), None, 0.5, GroundPlane(np.array([0.0, 0, 1]), floor_m))
    bodies = zip(gavrila.shapes, gavrila.centers_part, gavrila.kinematics(values).Ts_world_part, strict=True)
    lowest = min(rigid.apply(T, s.triangles().vertices + center)[:, 2].min() for s, center, T in bodies)
    assert lowest == pytest.approx(floor_m if floor_m < 0.6 else standing_extent_m(gavrila)[0], abs=1e-4)


def test_up_rotations_are_rotations():
    for up, R in UP_ROTATIONS.items():
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1)
        axis = np.eye(3)["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1)
        np.testing.assert_allclose(R[:, 2], axis)
