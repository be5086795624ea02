"""Find out whether imported joints lag behind the tracked ones by a number of frames, the same throughout."""

import numpy as np

from tracker.geometry.arrays import Array
from tracker.observations.shifts import SAMPLES, evenly, is_clear_minimum, median_over_time, n_stretches
from tracker.observations.triangulation import INLIER_M


def lag_frames(imported_world: Array, tracked_world: Array, frames: Array) -> int:
    """Return by how many frames imported joints lag behind tracked ones; 0 if that is not clear.

    At the lag they lie nearest, without the median offset of each joint, and nearer than without it and at twice the
    lag in each stretch of the recording. It is less than a quarter of the recording, and `SAMPLES` frames.

    Args:
        imported_world: joints by frame, (n_frames, n, 3), metres; NaN where unknown.
        tracked_world: joints of the tracked frames, (n_tracked, n, 3).
        frames: which these are, ascending, (n_tracked,).
    """
    margin = min(len(frames) // 4, SAMPLES)
    inner = np.flatnonzero((frames >= margin) & (frames < len(imported_world) - margin))
    if len(inner) < n_stretches(margin) or not margin:
        return 0
    inner = inner[evenly(len(inner), SAMPLES * n_stretches(margin))]
    costs = np.empty((2 * margin + 1, n_stretches(margin)))
    for row in range(len(costs)):
        steps = imported_world[frames[inner] + row - margin] - tracked_world[inner]
        flat = steps.reshape(len(steps), -1)
        apart = np.linalg.norm((flat - median_over_time(flat)).reshape(steps.shape), axis=-1)
        squares = np.minimum(apart / INLIER_M, 1.0) ** 2
        blocks = [block[np.isfinite(block)] for block in np.array_split(squares, costs.shape[1])]
        costs[row] = [float(np.mean(block)) if len(block) else 1.0 for block in blocks]
    lag = int(costs.mean(axis=1).argmin()) - margin
    return lag if lag and is_clear_minimum(costs, lag, 0) else 0
