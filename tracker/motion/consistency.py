"""Frames whose pose does not go together with those around it: a second opinion from the motion itself.

Where a run of a tracker meets a keyframe, or another run, both have an opinion of the same moment, and the body jumps
by as much as they disagree. So does a pose that is wrong for a single frame. A step from one frame to the next is
compared with the steps before and after it, joint by joint:

    off(f) = max over joints of |s(f) - (s(f-1) + s(f+1)) / 2|,  s(f) = p(f+1) - p(f)

which is a jump at once, and nothing for a steady motion. What people's hands do in everyday and in vigorous motion
stays below an acceleration of 90 m/s^2; what needs more is called a disagreement.
"""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array

_MOST_M_S2 = 90.0
_LEAST_M, _MOST_M = 0.05, 0.25
"""Jumps below are noise of a good tracker; above they count at any frame rate."""


def threshold_m(fps: float) -> float:
    """How far off a step may be at a frame rate, metres."""
    return float(np.clip(_MOST_M_S2 / fps**2, _LEAST_M, _MOST_M))


def motion_residuals_m(points_world: Array) -> Array:
    """How far each step of consecutive frames is off those before and after it.

    Args:
        points_world: joints on n consecutive frames, (n, n_points, 3), metres.

    Returns:
        Of the step to each frame but the first the largest distance over the joints, (n - 1,), metres; 0 for less than
        three frames, where there is nothing to compare with.
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
    """Find the frames that disagree with their neighbours.

    Args:
        models: the body that each pose was made with.
        frames: that have a pose, ascending.
        values: their poses, (n, n_values).
        keyframes: those that a person vouches for; of two that disagree the other one is named.
        fps: frame rate, 1/s.

    Returns:
        One frame for each jump, ascending: the later of the two unless that is a keyframe and the earlier is none.
    """
    at = np.asarray(frames, dtype=np.int64)
    found: list[int] = []
    for run in np.split(np.arange(len(at)), np.flatnonzero(np.diff(at) != 1) + 1):
        off = (
            motion_residuals_m(np.array([models[i].points_world(values[i]) for i in run]))
            if len(run) > 1
            else np.zeros(0)
        )
        # A jump shows, halved, in the steps beside it too: only the largest of them is one.
        beside = np.pad(off, 1)
        peaks = (off > threshold_m(fps)) & (off >= beside[:-2]) & (off > beside[2:])
        for i in np.flatnonzero(peaks):
            earlier, later = int(at[run[i]]), int(at[run[i + 1]])
            found.append(earlier if later in keyframes and earlier not in keyframes else later)
    return sorted(set(found))
