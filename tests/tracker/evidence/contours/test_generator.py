"""Outlines of single parts against the convex hulls of dense meshes, which are independent of how they are traced."""

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree
from staging import camera_at, solid

from tracker.body.model import PosedBody
from tracker.evidence.contours.occluding_contours import trace
from tracker.formats.model_toml import parse_model

CONE = """
version = 1
name = "cone"
height_m = 1.0
parts = [{ name = "solid", shape = "cone", half_axes = [0.06, 0.1, 0.25], taper = TAPER }]
[[joints]]
name = "root"
child = "solid"
kind = "ball"
free = true
"""


def cone(taper):
    return parse_model(CONE.replace("TAPER", str(taper)), "cone")


def ball_joint(model):
    """The same solid on a ball joint, so that a quaternion turns it any way."""
    return parse_model(CONE.replace('shape = "cone", half_axes = [0.06, 0.1, 0.25], taper = TAPER', model), "solid")


SOLIDS = {
    "cone": cone(0.4),
    "cylinder": cone(0.0),
    "cone upside down": cone(-0.6),
    "ellipsoid": ball_joint('shape = "ellipsoid", half_axes = [0.1, 0.06, 0.2]'),
    "limb": ball_joint("half_axes = [0.05, 0.05, 0.2], exponents = [0.35, 1.0], taper = [0.22, 0.22]"),
    "trunk": ball_joint("half_axes = [0.12, 0.17, 0.31], exponents = [0.5, 0.8], taper = [0.0, 0.04]"),
}
FRONT = camera_at("front", (4.0, 0.0, 0.0))


def hull_of_mesh(body, camera):
    """Outline of a convex solid: the hull of a mesh so dense that its corners hardly deviate, points 0.25 px apart."""
    T = body.model.kinematics(body.values).Ts_world_part[0]
    points = body.model.shapes[0].grid(160, 240)[0].reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
    hull = cv2.convexHull(camera.project(points).astype(np.float32))[:, 0]
    ring = np.concatenate([hull, hull[:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))])
    at = np.arange(0, along[-1], 0.25)
    return np.stack([np.interp(at, along, c) for c in ring.T], axis=1)


def dense(pieces_px):
    t = np.linspace(0, 1, 9)[:, None, None]
    return (pieces_px[:, :2] + t * (pieces_px[:, 2:] - pieces_px[:, :2])).reshape(-1, 2)


@pytest.mark.slow
@pytest.mark.parametrize("name", SOLIDS)
def test_outline_is_that_of_a_dense_mesh(name):
    rng = np.random.default_rng(4)
    model = SOLIDS[name]
    # The trunk is traced on a grid of 15 degrees: its chords run 1.7% of its radius of 22 px inside.
    bound = 0.5 if name == "trunk" else 0.3
    for _ in range(30):
        q = rng.normal(size=4)
        body = PosedBody(model, np.array([*rng.uniform(-0.4, 0.4, 3), *(q / np.linalg.norm(q))]))
        found, expected = dense(trace([body], FRONT).pieces_px), hull_of_mesh(body, FRONT)
        assert cKDTree(expected).query(found)[0].max() < bound
        assert cKDTree(found).query(expected)[0].max() < bound + 0.25


@pytest.mark.parametrize("tilt", [0.0, 0.05, 0.5, 1.2])
def test_along_the_axis_only_the_ends_show(tilt):
    """A cone seen from one end: its larger end is the whole outline; tilted, two straight rulings join both ends."""
    body = PosedBody(
        SOLIDS["cone"], np.array([0, 0, 0, np.cos((np.pi / 2 - tilt) / 2), 0, np.sin((np.pi / 2 - tilt) / 2), 0])
    )
    contours = trace([body], FRONT)
    assert cKDTree(hull_of_mesh(body, FRONT)).query(dense(contours.pieces_px))[0].max() < 0.3
    T = body.model.kinematics(body.values).Ts_world_part[0]
    heights = ((contours.points_world - T[:3, 3]) @ T[:3, :3])[:, 2] / 0.25
    on_the_side = np.abs(heights) < 0.99
    assert on_the_side.any() == (tilt > 0.1)


def test_rulings_are_straight_and_graze():
    body = PosedBody(SOLIDS["cone"], np.array([0.1, 0.2, 0.1, *_quaternion((0.3, 0.4, 0.5))]))
    contours = trace([body], FRONT)
    T = body.model.kinematics(body.values).Ts_world_part[0]
    points = (contours.points_world - T[:3, 3]) @ T[:3, :3]
    side = np.abs(points[:, 2]) < 0.24
    x, y, z = (points[side] / (0.06, 0.1, 0.25)).T
    np.testing.assert_allclose(x**2 + y**2, (1 + 0.4 * z) ** 2, rtol=1e-4)
    normals = np.stack([x / 0.06, y / 0.1, -0.4 * (1 + 0.4 * z) / 0.25], axis=1)
    sight = points[side] - (FRONT.center_world - T[:3, 3]) @ T[:3, :3]
    cosines = np.sum(normals * sight, axis=1) / np.linalg.norm(normals, axis=1) / np.linalg.norm(sight, axis=1)
    assert np.abs(cosines).max() < 1e-4
    # Two rulings: the points of each lie at one angle about the axis.
    assert len(np.unique(np.round(np.arctan2(y, x), 3))) == 2


def test_a_superquadric_that_nearly_is_a_cone_has_its_outline():
    blunt = solid((0.1, 0.1, 0.25), (0.05, 1.0))
    sharp = parse_model(CONE.replace("0.06, 0.1", "0.1, 0.1").replace("TAPER", "0"), "cylinder")
    one = trace([PosedBody(blunt, np.array([0.0, 0, 0, 0.4, 0, 0]))], FRONT)
    other = trace([PosedBody(sharp, np.array([0.0, 0, 0, *_quaternion((0.4, 0, 0))]))], FRONT)
    assert cKDTree(dense(other.pieces_px)).query(dense(one.pieces_px))[0].max() < 0.6


def _quaternion(turn):
    angle = np.linalg.norm(turn)
    return (np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(turn) / angle))
