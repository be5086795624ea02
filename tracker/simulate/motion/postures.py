"""Solve postures for poses: trunk, feet and hands are given, the limbs are computed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.simulate.people.anatomy import ANKLE_HEIGHT
from tracker.simulate.people.builds import MAN, Build
from tracker.simulate.people.outfit import Outfit

HEADING_RAD = np.radians(32.0)
"""Heading of the person: towards FRONT, but not exactly, because a forward motion would hardly show."""
TOES_OUT_RAD = np.radians(9.0)
ELBOW_WEIGHT = 0.03
"""Weight of an elbow's position error against that of the wrist."""
WITHIN_REACH_M = 0.01
"""Largest error of a wrist, metres: within flesh, joint limits may prevent an exact solution."""


@dataclass(frozen=True)
class Role:
    """One person of a scene."""

    name: str
    height_m: float
    """Body height, metres."""
    act: Callable[[BodyModel, float], "Posture"]
    """Returns the posture of a body of these dimensions at a time in seconds."""
    build: Build = MAN
    """Bones and flesh."""
    outfit: Outfit = field(default_factory=Outfit)
    """Clothes and colours."""


class Reach(NamedTuple):
    """The target of an arm, in the frame of the actor's place."""

    wrist_m: tuple[float, float, float]
    """Position of the wrist, metres."""
    elbow_to: tuple[float, float, float]
    """Direction from the line between shoulder and wrist in which the elbow points."""


@dataclass(frozen=True, eq=False)
class Posture:
    """A pose in an actor's terms; hips and knees follow from trunk and feet."""

    trunk_m: tuple[float, float, float]
    """Torso centre, metres, in the frame of the actor's place: x ahead, y left, z from the floor."""
    lean: Array
    """Rotation of the trunk from upright facing ahead, (3, 3)."""
    feet_m: Mapping[str, tuple[float, float, float]]
    """`left` and `right` ankle in the frame of the actor's place, metres."""
    angles: Mapping[str, float]
    """Degrees of freedom of the arms without a target, rad."""
    toes_rad: Mapping[str, float] = field(default_factory=lambda: {"left": 0.0, "right": 0.0})
    """Heading of the `left` and `right` foot, turned left from ahead in the frame of the actor's place."""
    reaches: Mapping[str, Reach] = field(default_factory=dict)
    """Targets of the `left` and the `right` arm, if any."""


def solve_posture(role: Role, model: BodyModel, n_frames: int, fps: float) -> Array:
    """Solve the postures of a role for the poses of a body, (n_frames, n_values)."""
    R_world_place = rigid.so3_exp(np.array([0.0, 0.0, HEADING_RAD]))
    at_twist = model.value_names.index("torso.twist")
    poses: list[Array] = []
    for k in range(n_frames):
        posture = role.act(model, k / fps)
        values = poses[-1].copy() if poses else _upright(model)
        values[:3] = R_world_place @ posture.trunk_m
        for name, angle in (_torso_angles(R_world_place @ posture.lean) | dict(posture.angles)).items():
            values[model.value_names.index(name)] = angle
        if poses:
            # Unwrap the turn of the trunk: the angles of a body that keeps turning keep growing.
            values[at_twist] += 2 * np.pi * np.round((poses[-1][at_twist] - values[at_twist]) / (2 * np.pi))
        for side, ankle in posture.feet_m.items():
            _plant(model, values, side, R_world_place @ ankle, HEADING_RAD + posture.toes_rad[side])
        for side, (wrist, elbow_to) in posture.reaches.items():
            _reach(model, values, side, R_world_place @ wrist, R_world_place @ elbow_to)
        assert np.allclose(values, model.clip(values)), "the scene asks for a pose beyond the joint limits"
        poses.append(values)
    return np.array(poses)


def ramp(t: float, start: float, end: float) -> float:
    """Rise from 0 to 1 between two times, at rest at both ends."""
    s = min(max((t - start) / (end - start), 0.0), 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


def _upright(model: BodyModel) -> Array:
    """Return the start of the first frame's solution: knees and elbows bent, which determines their direction."""
    values = model.neutral()
    for i, name in enumerate(model.value_names):
        values[i] += 0.4 * name.endswith("_knee.extension") + 0.2 * name.endswith(("_hip.elevation", "_hip.flexion"))
        values[i] += 1.2 * name.endswith("_elbow.extension") + 0.4 * name.endswith("_shoulder.elevation")
    return values


def standing_height(model: BodyModel) -> float:
    """Return the height of the torso centre over the floor with straight legs, metres."""
    points = model.named_points_world(model.neutral())
    return float(ANKLE_HEIGHT * model.height_m - points["left_ankle"][2])


def stance(model: BodyModel) -> dict[str, tuple[float, float, float]]:
    """Return the ankles of a relaxed stance, metres."""
    y, z = 0.068 * model.height_m, ANKLE_HEIGHT * model.height_m
    return {"left": (-0.02, y, z), "right": (0.0, -y, z)}


def _torso_angles(R_world_torso: Array) -> dict[str, float]:
    """Return the angles whose rotation `Rx(abduction) Ry(elevation) Rz(twist)` is the given one."""
    return {
        "torso.abduction": float(np.arctan2(-R_world_torso[1, 2], R_world_torso[2, 2])),
        "torso.elevation": float(np.arcsin(R_world_torso[0, 2])),
        "torso.twist": float(np.arctan2(-R_world_torso[0, 1], R_world_torso[0, 0])),
    }


def _plant(model: BodyModel, values: Array, side: str, ankle_world: Array, heading: float) -> None:
    """Solve one leg's four angles in place for the position of the ankle, with the toes a little out."""
    dofs = np.array([i for i, n in enumerate(model.dof_names) if n.startswith((f"{side}_hip.", f"{side}_knee."))])
    at = model.dof_value[dofs]
    ankle, calf = model.point_names.index(f"{side}_ankle"), model.part_index[f"{side}_calf"]
    toes = heading + (TOES_OUT_RAD if side == "left" else -TOES_OUT_RAD)
    aside = np.array([-np.sin(toes), np.cos(toes), 0.0])

    def errors(angles: Array) -> Array:
        trial = values.copy()
        trial[at] = angles
        R_calf = model.kinematics(trial).Ts_world_part[calf, :3, :3]
        return np.append(model.points_world(trial)[ankle] - ankle_world, R_calf[:, 0] @ aside)

    cost = _solve(model, values, dofs, errors)
    assert cost < 1e-8, f"the {side} leg cannot reach its place on the floor"


def _reach(model: BodyModel, values: Array, side: str, wrist_world: Array, elbow_to_world: Array) -> None:
    """Solve one arm's four angles in place for the position of the wrist and the direction of the elbow."""
    dofs = np.array([i for i, n in enumerate(model.dof_names) if n.startswith((f"{side}_shoulder.", f"{side}_elbow."))])
    at = model.dof_value[dofs]
    shoulder, elbow, wrist = (model.point_names.index(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist"))
    points = model.points_world(values)
    upper, fore = np.linalg.norm(points[elbow] - points[shoulder]), np.linalg.norm(points[wrist] - points[elbow])
    way = wrist_world - points[shoulder]
    length = np.linalg.norm(way)
    assert abs(upper - fore) < length < upper + fore, f"the {side} hand cannot reach {length:.2f} m"
    ahead = way / length
    aside = elbow_to_world - (elbow_to_world @ ahead) * ahead
    # The two circles about shoulder and wrist on which the elbow may lie intersect here.
    along = (upper**2 - fore**2 + length**2) / (2 * length)
    bend = points[shoulder] + along * ahead + np.sqrt(upper**2 - along**2) * aside / np.linalg.norm(aside)

    def errors(angles: Array) -> Array:
        trial = values.copy()
        trial[at] = angles
        found = model.points_world(trial)
        return np.append(found[wrist] - wrist_world, ELBOW_WEIGHT * (found[elbow] - bend))

    _solve(model, values, dofs, errors)
    off = float(np.linalg.norm(model.points_world(values)[wrist] - wrist_world))
    assert off < WITHIN_REACH_M, f"the {side} hand is {off:.3f} m from where it should be"


def _solve(model: BodyModel, values: Array, dofs: IntArray, errors: Callable[[Array], Array]) -> float:
    """Minimize errors over some degrees of freedom from the current pose, in place; return the remaining cost."""
    at = model.dof_value[dofs]
    low, high = model.limits[dofs].T
    start = np.clip(values[at], low + 1e-3, high - 1e-3)
    solution = least_squares(errors, start, bounds=(low, high), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    values[at] = solution.x
    return float(solution.cost)
