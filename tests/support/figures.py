"""A figure of voxels with known joints, unlike any body model of the program."""

from functools import lru_cache
from types import MappingProxyType

import numpy as np
from staging import camera_at

from tracker.estimation.initialization.generators.person_scene import PersonScene
from tracker.estimation.initialization.generators.voxel_start import locate_parts, possible_heads
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.figure_masks import figure_masks, paint
from tracker.evidence.voxels.geodesic_distance import neighbor_graph
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.ground_plane import GroundPlane

UP = np.array([0.0, 0.0, 1.0])
STANDING = [
    {"arms_deg": arms, "legs_deg": legs, "turn_deg": turn}
    for arms, legs, turn in (
        (35, 12, 0), (45, 15, 30), (60, 10, 75), (30, 20, 120), (80, 12, 160),
        (40, 14, 200), (55, 18, 250), (35, 10, 290), (70, 16, 310), (50, 12, 345),
    )
]  # fmt: skip
"""Poses of the figure."""


def joints_of(arms_deg=35.0, legs_deg=12.0, turn_deg=0.0):
    """Joints of a person who stands at the origin and faces x, turned about z; arms and legs spread by angles."""
    found = {"neck": (0, 0, 1.45), "head": (0, 0, 1.62)}
    for side, y in (("left", 1), ("right", -1)):
        a, b = np.radians([arms_deg, legs_deg])
        arm, leg = np.array([0, y * np.sin(a), -np.cos(a)]), np.array([0, y * np.sin(b), -np.cos(b)])
        found[f"{side}_shoulder"] = shoulder = np.array([0, y * 0.18, 1.40])
        found[f"{side}_elbow"] = shoulder + 0.29 * arm
        found[f"{side}_wrist"] = shoulder + 0.55 * arm
        found[f"{side}_hip"] = hip = np.array([0, y * 0.10, 0.92])
        found[f"{side}_knee"] = hip + 0.43 * leg
        found[f"{side}_ankle"] = hip + 0.84 * leg
    t = np.radians(turn_deg)
    R = np.array([[np.cos(t), -np.sin(t), 0], [np.sin(t), np.cos(t), 0], [0, 0, 1]])
    return {n: R @ np.array(p, float) for n, p in found.items()}, R


@lru_cache(maxsize=16)
def figure(size_m=0.025, noise=0.0, head=1.0, **pose):
    """Voxels of such a person, and the true joints.

    `noise` is the share of surface voxels that are missing, `head` the size of the head as a share of an adult's.
    """
    joints, R = joints_of(**pose)
    grid = VoxelGrid.over(np.array([-0.9, -0.9, -0.05]), np.array([0.9, 0.9, 2.25]), size_m)
    points = grid.centers(np.argwhere(np.ones(grid.shape, bool)))
    trunk = (points - (0, 0, 1.16)) @ R
    inside = np.linalg.norm((points - joints["head"]) / np.multiply(head, (0.09, 0.09, 0.125)), axis=1) <= 1
    inside |= (np.linalg.norm(trunk[:, :2] / (0.12, 0.18), axis=1) <= 1) & (np.abs(trunk[:, 2]) < 0.30)
    inside |= _capsule(points, joints["neck"] - (0, 0, 0.05), joints["neck"] + (0, 0, 0.08), 0.055)
    for side in ("left", "right"):
        arm, leg = joints[f"{side}_wrist"] - joints[f"{side}_shoulder"], joints[f"{side}_ankle"]
        inside |= _capsule(points, joints[f"{side}_shoulder"], joints[f"{side}_wrist"] + 0.15 * arm, 0.05)
        inside |= _capsule(points, joints[f"{side}_hip"], joints[f"{side}_knee"], 0.075)
        inside |= _capsule(points, joints[f"{side}_knee"], leg, 0.055)
        inside |= _capsule(points, leg - (0, 0, 0.03), leg - (0, 0, 0.03) + 0.17 * R[:, 0], 0.04)
    voxels = Voxels(grid, inside.reshape(grid.shape))
    if noise:
        rng = np.random.default_rng(0)
        voxels = voxels.without(voxels.is_surface & (rng.random(len(voxels.indices)) < noise))
    return voxels.cropped(), MappingProxyType(joints)


def child(share=0.6, head=0.8, size_m=0.025, **pose):
    """Voxels of a child, and the true joints; the sizes of body and head as shares of an adult's."""
    voxels, joints = figure(size_m / share, head=head / share, **pose)
    return voxels.scaled(share), {n: share * p for n, p in joints.items()}


def _capsule(points, a, b, radius):
    axis = b - a
    along = np.clip((points - a) @ axis / (axis @ axis), 0, 1)
    return np.linalg.norm(points - a - along[:, None] * axis, axis=1) <= radius


def silhouettes_of_figure(voxels, cameras):
    """Silhouettes of a figure, as masks."""
    found = []
    for camera in cameras:
        empty = ViewSilhouette(np.zeros((camera.height, camera.width), bool), camera, 1.0, "mask")
        surface = voxels.grid.centers(voxels.indices[voxels.is_surface])
        found.append(empty._replace(mask=paint(surface, voxels.grid.size_m, empty)))
    return found


def cameras_about_a_figure(n=4):
    """Cameras on a circle about a standing person, none opposite another."""
    turns = 2.0 * np.arange(n) * np.pi / n + 0.2 * np.arange(n)
    places = [(4.0 * np.cos(t), 4.0 * np.sin(t), 1.3) for t in turns]
    return [camera_at(f"c{i}", place, (0.0, 0.0, 0.9), focal=560.0) for i, place in enumerate(places)]


def scene_of(voxels, silhouettes):
    """What is known of a figure that is alone."""
    return PersonScene(voxels, silhouettes, figure_masks(silhouettes, voxels), GroundPlane(UP, 0.0))


def parts_of(voxels):
    """The parts of a figure with its most likely head."""
    graph = neighbor_graph(voxels)
    return locate_parts(voxels, graph, possible_heads(voxels, graph, UP)[0])


def legs(silhouette):
    """The lower third of a silhouette."""
    rows = np.flatnonzero(silhouette.mask.any(axis=1))
    own = silhouette.mask.copy()
    own[: rows[0] + 2 * len(rows) // 3] = False
    return own


def hide_legs(silhouettes, views, shadows):
    """Take the legs for shadow in some views, beside the shadows of all views."""
    return [
        s._replace(mask=s.mask & ~legs(s), shadow=shadow | legs(s)) if i in views else s._replace(shadow=shadow)
        for i, (s, shadow) in enumerate(zip(silhouettes, shadows, strict=True))
    ]
