"""From postures to poses: trunk and feet are placed, the legs follow."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from tracker import rigid
from tracker.body import BodyModel
from tracker.rigid import Array
from tracker.simulate.anatomy import ANKLE_HEIGHT

HEADING_RAD = np.radians(32.0)
"""Where the person faces: towards FRONT, but not straight at it, where a forward motion would hardly show."""
TOES_OUT_RAD = np.radians(9.0)


@dataclass(frozen=True)
class Role:
    """One person of a scene."""

    name: str
    height_m: float
    """Body height, metres."""
    act: Callable[[BodyModel, float], "Posture"]
    """Posture of a body of these sizes at a time in seconds."""


@dataclass(frozen=True, eq=False)
class Posture:
    """A pose as an actor thinks of it; the hips and knees follow from where trunk and feet are."""

    trunk_m: tuple[float, float, float]
    """Torso centre, metres, in the frame of the actor's place: x ahead, y left, z from the floor."""
    lean: Array
    """Rotation of the trunk from upright facing ahead, (3, 3)."""
    feet_m: Mapping[str, tuple[float, float, float]]
    """`left` and `right` ankle in the frame of the actor's place, metres."""
    angles: Mapping[str, float]
    """Degrees of freedom of the arms, rad."""
    toes_rad: Mapping[str, float] = field(default_factory=lambda: {"left": 0.0, "right": 0.0})
    """Where the `left` and `right` foot head, turned left from ahead in the frame of the actor's place."""


def perform(role: Role, model: BodyModel, n_frames: int, fps: float) -> Array:
    """Poses of a role played by a body, (n_frames, n_values)."""
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
            # A body that turns on and on has angles that go on and on.
            values[at_twist] += 2 * np.pi * np.round((poses[-1][at_twist] - values[at_twist]) / (2 * np.pi))
        for side, ankle in posture.feet_m.items():
            _plant(model, values, side, R_world_place @ ankle, HEADING_RAD + posture.toes_rad[side])
        assert np.allclose(values, model.clip(values)), "the scene asks for a pose beyond the joint limits"
        poses.append(values)
    return np.array(poses)


def ramp(t: float, start: float, end: float) -> float:
    """Rise from 0 to 1 between two times, at rest at both ends."""
    s = min(max((t - start) / (end - start), 0.0), 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


def _upright(model: BodyModel) -> Array:
    """Pose to start the first frame's leg search from: knees a little bent, so that they know which way to go."""
    values = model.neutral()
    for i, name in enumerate(model.value_names):
        values[i] += 0.4 * name.endswith("_knee.extension") + 0.2 * name.endswith("_hip.elevation")
    return values


def standing_height(model: BodyModel) -> float:
    """Height of the torso centre over the floor with straight legs, metres."""
    points = dict(zip(model.point_names, model.points_world(model.neutral()), strict=True))
    return float(ANKLE_HEIGHT * model.height_m - points["left_ankle"][2])


def stance(model: BodyModel) -> dict[str, tuple[float, float, float]]:
    """Ankles of a relaxed stance, metres."""
    y, z = 0.068 * model.height_m, ANKLE_HEIGHT * model.height_m
    return {"left": (-0.02, y, z), "right": (0.0, -y, z)}


def _torso_angles(R_world_torso: Array) -> dict[str, float]:
    """Angles whose rotation `Rx(abduction) Ry(elevation) Rz(twist)` is the given one."""
    return {
        "torso.abduction": float(np.arctan2(-R_world_torso[1, 2], R_world_torso[2, 2])),
        "torso.elevation": float(np.arcsin(R_world_torso[0, 2])),
        "torso.twist": float(np.arctan2(-R_world_torso[0, 1], R_world_torso[0, 0])),
    }


def _plant(model: BodyModel, values: Array, side: str, ankle_world: Array, heading: float) -> None:
    """Solve one leg's four angles, in place: the ankle where it should be, the toes pointing a little out."""
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

    low, high = model.limits[dofs].T
    start = np.clip(values[at], low + 1e-3, high - 1e-3)
    solution = least_squares(errors, start, bounds=(low, high), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    assert solution.cost < 1e-8, f"the {side} leg cannot reach its place on the floor"
    values[at] = solution.x
