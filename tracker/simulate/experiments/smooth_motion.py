"""A smooth motion of every degree of freedom of a body, as the simulated data of KRH08 Sect. 6 have."""

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array

_BENT_DEG = {
    "shoulder.abduction": 40.0, "shoulder.elevation": 25.0, "elbow.extension": 55.0, "hip.flexion": 25.0,
    "hip.elevation": 25.0, "hip.abduction": 12.0, "knee.extension": 45.0,
}  # fmt: skip
"""Angles about which limbs move, so that none is straight or hidden behind the trunk for long."""
_SWING_RAD = float(np.radians(22.0))
"""Amplitude of a limb's angle."""
_SPREAD_SHARE = 0.8
"""Amplitude of an angle with a spread, in that spread."""
_LIMIT_SHARE = 0.8
"""Largest amplitude, as a share of the distance to the nearer joint limit."""
_TRUNK_RAD, _TURN_RAD, _SWAY_M = float(np.radians(12.0)), float(np.radians(60.0)), 0.25
"""Amplitudes of the root: lean, turn about the vertical and position."""
_HEIGHT_M, _BOB_M = 1.05, 0.08
"""Mean height of the root over the floor, and its amplitude."""
_HERTZ = (0.15, 0.4)
"""Slowest and fastest oscillation of an angle."""


def smooth_motion(model: BodyModel, n_frames: int, fps: float, seed: int) -> Array:
    """Return poses in which every degree of freedom oscillates at a frequency and phase of its own.

    Args:
        model: the body; only revolute joints and a free root of three rotations.
        n_frames: number of frames.
        fps: frame rate, 1/s.
        seed: of frequencies and phases.

    Returns:
        Poses within the joint limits, (n_frames, n_values).
    """
    rng, t = np.random.default_rng([seed, 7]), np.arange(n_frames) / fps
    out = np.tile(model.neutral(), (n_frames, 1))
    for dof, name in enumerate(model.dof_names):
        middle, amplitude = _swing(model, dof, name)
        wave = np.sin(2 * np.pi * rng.uniform(*_HERTZ) * t + rng.uniform(0, 2 * np.pi))
        out[:, model.dof_value[dof]] = middle + amplitude * wave
    return model.clip(out)


def _swing(model: BodyModel, dof: int, name: str) -> tuple[float, float]:
    """Return the middle and the amplitude of a degree of freedom, rad or metres."""
    joint, axis = name.removeprefix("left_").removeprefix("right_").rsplit(".", 1)
    if model.dof_is_length[dof]:
        return (_HEIGHT_M * model.height_m / 1.75, _BOB_M) if axis == "z" else (0.0, _SWAY_M)
    if model.dof_joint[dof] == 0:
        return 0.0, _TURN_RAD if axis == "twist" else _TRUNK_RAD
    middle = float(np.radians(_BENT_DEG.get(f"{joint}.{axis}", 0.0)))
    spread, (low, high) = float(model.spreads[dof]), model.limits[dof]
    amplitude = _SPREAD_SHARE * spread if np.isfinite(spread) else _SWING_RAD
    return middle, min(amplitude, _LIMIT_SHARE * float(min(high - middle, middle - low)))
