"""Errors on frames that a first adjustment has left out: what cameras are worth where they were not fitted."""

from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array, IntArray

_EVERY = 5
"""One frame in so many is held out: a fifth, as in fivefold cross-validation."""


class HeldOut(NamedTuple):
    """Observations on frames that were held out; a second adjustment uses all frames."""

    frames: IntArray
    """The frames, ascending."""
    cameras: IntArray
    """Camera of each observation on them, (N,)."""
    px: Array
    """Distance of each of these to the projection of its point, (N,), px."""

    def rms_px(self, camera: int | None = None) -> float:
        """Return the root mean square error of one camera or all; NaN without observations."""
        px = self.px if camera is None else self.px[self.cameras == camera]
        return float(np.sqrt(np.mean(px**2))) if len(px) else float("nan")


def held_out_of(frames: IntArray) -> IntArray:
    """Return the frames to hold out, of those of an adjustment, (F,)."""
    return frames[_EVERY // 2 :: _EVERY]
