"""Drive a character: the pose of a person on another body, bone by bone (KRH08 Sect. 6.1).

Bodies may differ in sizes, proportions and joints. Every bone that both have keeps its direction in space. The
character stands at the person's place, and its lowest point is as high above the ground, in body heights.
"""

import numpy as np

from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import JOINT_M, UNKNOWN, PointTargets, PosePrior, ResidualBlock, solve
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import GroundPlane


def drive_character(pose: Array, source: BodyModel, character: BodyModel, floor: GroundPlane) -> Array:
    """Return the pose of a character, (n_values,), that moves as a person does.

    Args:
        pose: of the person, (n_values,).
        source: body of the person.
        character: the other body.
        floor: what both stand on.
    """
    names, places = list(source.point_names), source.points_world(pose)
    known = dict(zip(names, places, strict=True))
    rest = character.named_points_world(character.neutral())
    first = character.joints[0].name
    wanted = {first: known.get(first, places[0])}
    for parent, child in character.bones:
        if parent in wanted and parent in known and child in known:
            bone, length_m = known[child] - known[parent], np.linalg.norm(rest[child] - rest[parent])
            if np.linalg.norm(bone) > 0:
                wanted[child] = wanted[parent] + length_m * bone / np.linalg.norm(bone)
    points = np.array([i for i, n in enumerate(character.point_names) if n in wanted], dtype=np.int64)
    targets = np.array([wanted[character.point_names[i]] for i in points])
    start = _named_alike(pose, source, character)
    blocks: list[ResidualBlock] = [
        PointTargets(points, targets, np.full(len(points), 1 / JOINT_M)),
        PosePrior(start, np.full(character.n_dofs, 1 / UNKNOWN)),
    ]
    found = solve(character, start, blocks).pose
    return _on_floor(found, character, places, character.height_m / source.height_m, floor)


def _named_alike(pose: Array, source: BodyModel, character: BodyModel) -> Array:
    """Return the character's neutral pose, (n_values,), with all values that the person has by the same name."""
    values = dict(zip(source.value_names, pose, strict=True))
    neutral = zip(character.value_names, character.neutral(), strict=True)
    return character.clip(np.array([values.get(name, value) for name, value in neutral]))


def _on_floor(pose: Array, character: BodyModel, places: Array, scale: float, floor: GroundPlane) -> Array:
    """Return the pose raised or lowered so that the lowest point is as high as the person's, in body heights."""
    up, origin = floor.normal, floor.origin_world
    lowest = float(((places - origin) @ up).min())
    now = float(((character.points_world(pose) - origin) @ up).min())
    at = np.flatnonzero(character.dof_is_length)[:3]
    step = np.zeros(character.n_dofs)
    step[at] = (scale * lowest - now) * up
    return np.asarray(character.retract(pose, step))
