"""Compose the motion of all limbs from keys: tracks of angles, a path on the floor, and steps that follow it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.simulate.motion.postures import Posture, ramp, stance, standing_height

ARM_DOFS = ("shoulder.abduction", "shoulder.elevation", "shoulder.twist", "elbow.extension")
SIDES = ("left", "right")

_SWING = (0.06, 0.94)
"""Phases of a step at which the foot leaves the floor and lands."""
_SMALLEST_STEP = (0.03, np.radians(6.0))
"""A foot that would move by less, metres and rad, stays on the floor."""
_SOFTNESS_M = 0.010
"""Softness of the transition to a sinking trunk when a leg becomes straight."""


def glide(t: float, start: float, end: float) -> float:
    """Rise from 0 to 1 between two times like a walker: accelerate quickly, then move evenly."""
    s = min(max((t - start) / (end - start), 0.0), 1.0)
    return s * s * (3.0 - 2.0 * s)


@dataclass(frozen=True, eq=False)
class Track:
    """Values over time: interpolated between keys, at rest at each key."""

    times: Array
    """Ascending, (K,), seconds."""
    values: Array
    """(K, D)."""
    ease: Callable[[float, float, float], float] = ramp
    """Easing between two keys, from 0 to 1, like `ramp`."""

    def at(self, t: float) -> Array:
        """Return the values at a time, (D,); constant before the first and after the last key."""
        i = int(np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 1))
        if i + 1 == len(self.times):
            return self.values[i]
        share = self.ease(t, float(self.times[i]), float(self.times[i + 1]))
        return self.values[i] + share * (self.values[i + 1] - self.values[i])


@dataclass(frozen=True, eq=False)
class Choreography:
    """One person's motion in the frame of the actor's place: x ahead, y left, z up."""

    arms: Mapping[str, Track]
    """Angles of the `left` and `right` arm, in the order of `ARM_DOFS`, rad; empty for an arm with a target."""
    path: Track
    """Position of the trunk on the floor, metres, and heading, turned left from ahead, rad; (K, 3)."""
    crouch: Track
    """Height of the trunk below upright standing, fraction of body height, and forward bend, rad; (K, 2)."""
    lifts: Track
    """Lift of the `left` and the `right` foot, fraction of body height, (K, 2); used while the path rests."""
    sway_hz: float = 0.6
    """Frequency of the sway of the trunk, 1/s."""
    step_s: float = 0.42
    """Time from the landing of one foot to that of the other, seconds."""
    step_height_m: float = 0.07
    """Lift of a stepping foot, metres."""
    ahead_m: float = 0.0
    """Distance of the trunk ahead of the feet, metres, for a person who leans on somebody."""

    def act(self, model: BodyModel, t: float) -> Posture:
        """Return the posture at a time in seconds."""
        x, y, yaw = self.path.at(t)
        depth, bend = self.crouch.at(t)
        lifts = self.lifts.at(t)
        phase = 2 * np.pi * self.sway_hz * t
        sway = rigid.so3_exp(np.radians([1.5 * np.sin(phase), 1.2 * np.sin(0.7 * phase), 4.0 * np.sin(0.6 * phase)]))
        lean = _turned(yaw) @ rigid.so3_exp(np.array([0.0, bend, 0.0])) @ sway
        feet, toes = {}, {}
        for i, side in enumerate(SIDES):
            foot_x, foot_y, foot_yaw, height = self._foot(model, side, t)
            ahead = _turned(foot_yaw)[:2, 0] * 0.4 * lifts[i] * model.height_m
            z = stance(model)[side][2] + height + lifts[i] * model.height_m
            feet[side], toes[side] = (float(foot_x + ahead[0]), float(foot_y + ahead[1]), float(z)), float(foot_yaw)
        # The weight shifts over the standing foot; bending forward moves the hips back.
        aside = 0.16 * (lifts[1] - lifts[0]) * model.height_m
        moved = _turned(yaw)[:2, :2] @ (self.ahead_m - 0.13 * np.sin(bend) * model.height_m, aside)
        wanted = standing_height(model) - (0.006 + depth) * model.height_m
        trunk = np.array([x + moved[0], y + moved[1], wanted])
        trunk[2] = _within_reach(model, trunk, lean, feet)
        angles = {
            f"{side}_{dof}": float(angle)
            for side, track in self.arms.items()
            for dof, angle in zip(ARM_DOFS, track.at(t), strict=True)
        }
        return Posture((float(trunk[0]), float(trunk[1]), float(trunk[2])), lean, feet, angles, toes)

    def _foot(self, model: BodyModel, side: str, t: float) -> tuple[float, float, float, float]:
        """Return the position of a foot on the floor, metres, its heading, rad, and its lift in a step, metres."""
        before = here = self._footfalls[side][0]
        height = 0.0
        for start, landing in zip(self._step_starts[side], self._footfalls[side][1:], strict=True):
            if t <= start:
                break
            share = ramp(t, start + _SWING[0] * self.step_s, start + _SWING[1] * self.step_s)
            here = before + share * (landing - before)
            height = 4.0 * share * (1.0 - share) * self.step_height_m * bool(np.any(landing != before))
            before = landing
        offset = _turned(here[2])[:2, :2] @ stance(model)[side][:2]
        return here[0] + offset[0], here[1] + offset[1], here[2], height

    @cached_property
    def _step_starts(self) -> dict[str, Array]:
        n = int(self.path.times[-1] / (2 * self.step_s)) + 2
        starts = np.asarray(2 * self.step_s * np.arange(n), dtype=np.float64)
        return {"left": starts, "right": np.asarray(starts + self.step_s)}

    @cached_property
    def _footfalls(self) -> dict[str, Array]:
        """Return the path's values for which each foot stands before its first step and after each step."""
        out: dict[str, Array] = {}
        for side in SIDES:
            stands = [self.path.at(0.0)]
            for start in self._step_starts[side]:
                # A foot lands where it suits the middle of its next stance.
                wanted = self.path.at(start + 1.5 * self.step_s)
                small = (
                    np.linalg.norm(wanted[:2] - stands[-1][:2]) < _SMALLEST_STEP[0]
                    and abs(wanted[2] - stands[-1][2]) < _SMALLEST_STEP[1]
                )
                stands.append(stands[-1] if small else wanted)
            out[side] = np.array(stands)
        return out


def _turned(yaw: float) -> Array:
    return rigid.so3_exp(np.array([0.0, 0.0, yaw]))


def _within_reach(model: BodyModel, trunk: Array, lean: Array, feet: Mapping[str, tuple[float, float, float]]) -> float:
    """Return the height of the trunk, metres, at which both feet are within reach; smooth as a leg becomes straight."""
    points = model.named_points_world(model.neutral())
    heights = [float(trunk[2])]
    for side in SIDES:
        hip, knee, ankle = (points[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
        length = float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
        from_trunk = lean @ hip
        away = float(np.linalg.norm(trunk[:2] + from_trunk[:2] - feet[side][:2]))
        heights.append(feet[side][2] + float(np.sqrt(max(length**2 - away**2, 0.0)) - from_trunk[2]))
    lowest = min(heights)
    excess = np.exp(-(np.array(heights) - lowest) / _SOFTNESS_M).sum()
    return lowest - 0.002 - _SOFTNESS_M * float(np.log(excess))
