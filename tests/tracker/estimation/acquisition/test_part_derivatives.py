"""Derivatives of surface points by sizes and pose, against bodies that are really resized and moved."""

import numpy as np
import pytest
from rig_oracle import motions_of_points
from staging import posed

from tracker.estimation.acquisition.part_derivatives import motions_by_pose, part_size_jacobian, points_by_sizes
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.formats.model_toml import PRESETS, load_model

H = 1e-6


def staged(name):
    parameters = SizeParameters(load_model(name, 1.7))
    rng = np.random.default_rng(1)
    sizes = 0.5 * rng.normal(size=len(parameters.names)) * parameters.sigmas
    return parameters, sizes, posed(parameters.base, 2)


def surface(body, pose, part, unit_points):
    T = body.kinematics(pose).Ts_world_part[part]
    return (body.centers_part[part] + unit_points * body.shapes[part].half_axes) @ T[:3, :3].T + T[:3, 3]


def on_surface(body, part):
    """Points of a part in its unit coordinates, and its outward normals in the world's axes of an unturned part."""
    points, normals = (a.reshape(-1, 3) for a in body.shapes[part].grid(9, 12))
    unit = points / body.shapes[part].half_axes
    smooth = np.abs(np.abs(unit[:, 2]) - 1) > 1e-9  # not on the rim of a cone, nor on its flat ends
    return unit[smooth], normals[smooth]


def motions_of(body, kinematics, part, points, unit):
    """Derivatives of points of one part by its motions."""
    parts = np.full(len(points), part)
    return motions_of_points(body.shapes, parts, kinematics.Ts_world_part[parts], points, unit)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gavrila22_cones", "gavrila34"])
def test_surface_points_move_as_their_derivatives_say(name):
    """Across the surface: along it a point with the same unit coordinates may slide."""
    parameters, sizes, pose = staged(name)
    body = parameters.body(sizes)
    kinematics = body.kinematics(pose)
    by_sizes = part_size_jacobian(body, kinematics, parameters.derivatives(sizes))
    for part in range(len(body.parts)):
        unit, normals = on_surface(body, part)
        T = kinematics.Ts_world_part[part]
        found = motions_of(body, kinematics, part, surface(body, pose, part, unit), unit) @ by_sizes[part]
        across = normals @ T[:3, :3].T
        for i, parameter in enumerate(parameters.names):
            step = np.eye(len(sizes))[i] * 1e-5
            ends = [_moved(parameters.body(sizes + s * step), pose, part, unit, parameter) for s in (1, -1)]
            numeric = (ends[0] - ends[1]) / 2e-5
            np.testing.assert_allclose(
                np.sum(found[:, :, i] * across, axis=1), np.sum(numeric * across, axis=1), atol=2e-3, err_msg=parameter
            )


def _moved(body, pose, part, unit, parameter):
    """Where surface points are on a resized body: found along the ray from the centre if the shape has changed."""
    if "exponent" not in parameter and "taper" not in parameter:
        return surface(body, pose, part, unit)
    shape, low, high = body.shapes[part], np.full(len(unit), 0.5), np.full(len(unit), 2.0)
    for _ in range(60):
        middle = (low + high) / 2
        inside = shape.inside_outside(unit * middle[:, None] * shape.half_axes) < 1
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return surface(body, pose, part, unit * low[:, None])


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESETS)
def test_points_move_as_their_derivatives_say(name):
    parameters, sizes, pose = staged(name)
    body = parameters.body(sizes)
    found = points_by_sizes(body, body.kinematics(pose), parameters.derivatives(sizes))
    for i, step in enumerate(H * np.eye(len(sizes))):
        sides = [parameters.body(sizes + s * step).points_world(pose) for s in (1, -1)]
        np.testing.assert_allclose(found[:, :, i], (sides[0] - sides[1]) / (2 * H), atol=1e-7)


@pytest.mark.parametrize("name", PRESETS)
def test_a_pose_moves_the_parts_as_the_body_says(name):
    parameters, sizes, pose = staged(name)
    body = parameters.body(sizes)
    kinematics = body.kinematics(pose)
    by_pose = motions_by_pose(body, kinematics)
    for part in range(len(body.parts)):
        unit, _ = on_surface(body, part)
        points = surface(body, pose, part, unit)
        found = motions_of(body, kinematics, part, points, unit) @ by_pose[part]
        expected = body.point_jacobian(kinematics, np.full(len(points), part), points)
        np.testing.assert_allclose(found, expected, atol=1e-9)
