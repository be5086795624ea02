"""Find frames whose pose is inconsistent with the neighbouring frames, from the motion alone.

A tracking run may disagree with a keyframe or another run where they meet, so that the body jumps. It jumps too if
the pose of a single frame is wrong. Each step between frames is compared with the steps before and after it:

    off(f) = max over joints of |s(f) - (s(f-1) + s(f+1)) / 2|,  s(f) = p(f+1) - p(f)

This residual is 0 for a steady motion and large for a jump. Hands in everyday and in vigorous motion stay below an
acceleration of 90 m/s^2; a larger one counts as inconsistent.
"""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array

_MAX_ACCELERATION_M_S2 = 90.0
"""Largest acceleration of hands in everyday and in vigorous motion, m/s^2; see above."""
_THRESHOLDS_M = (0.05, 0.25)
"""Least and largest threshold, metres. Smaller residuals are tracking noise; larger ones are inconsistent at any frame
rate."""


def threshold_m(fps: float) -> float:
    """Return the largest consistent residual of a step at a frame rate, metres."""
    return float(np.clip(_MAX_ACCELERATION_M_S2 / fps**2, *_THRESHOLDS_M))


def motion_residuals_m(points_world: Array) -> Array:
    """Compare each step between consecutive frames with the steps before and after it.

    Args:
        points_world: joints on n consecutive frames, (n, n_points, 3), metres.

    Returns:
        For the step to each frame but the first, the largest residual over the joints, (n - 1,), metres. All 0 for
        fewer than three frames.
    """
    steps = np.diff(points_world, axis=0)
    if len(steps) < 2:
        return np.zeros(len(steps))
    around = np.empty_like(steps)
    around[1:-1] = (steps[:-2] + steps[2:]) / 2
    around[0], around[-1] = steps[1], steps[-2]
    return np.asarray(np.linalg.norm(steps - around, axis=-1).max(axis=-1))


def inconsistent_frames(
    models: Sequence[BodyModel], frames: Sequence[int], values: Array, keyframes: frozenset[int] | set[int], fps: float
) -> list[int]:
    """Find the frames that are inconsistent with their neighbours.

    Args:
        models: the body that each pose was made with.
        frames: frames that have a pose, ascending.
        values: their poses, (n, n_values).
        keyframes: frames set or verified by a person; of two inconsistent frames the other one is reported.
        fps: frame rate, 1/s.

    Returns:
        One frame for each jump, ascending: the later of the two, unless only that one is a keyframe.
    """
    at = np.asarray(frames, dtype=np.int64)
    found: list[int] = []
    for run in np.split(np.arange(len(at)), np.flatnonzero(np.diff(at) != 1) + 1):
        off = (
            motion_residuals_m(np.array([models[i].points_world(values[i]) for i in run]))
            if len(run) > 1
            else np.zeros(0)
        )
        # Half of a jump appears in the neighbouring steps too: only the largest of them counts.
        beside = np.pad(off, 1)
        peaks = (off > threshold_m(fps)) & (off >= beside[:-2]) & (off > beside[2:])
        for i in np.flatnonzero(peaks):
            earlier, later = int(at[run[i]]), int(at[run[i + 1]])
            found.append(earlier if later in keyframes and earlier not in keyframes else later)
    return sorted(set(found))
