"""Fit start poses to the contours of a frame, and compare them by short tracks in both directions."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_LOST_PX, _DOUBTFUL_PX = 2.0, 0.5
"""What a lost and a doubtful frame of a short track add to its cost, px."""
_MAX_FITS = 4
"""Largest number of fits to the frame of the start, each from the one before."""
_MIN_GAIN = 0.01
"""Smallest decrease of the cost, as a share, for another fit."""


class FittedStart(NamedTuple):
    """A start pose after the fit to contours."""

    pose: Array
    """(n_values,)."""
    status: Status
    """As the tracker gives it."""
    cost_px: float
    """Mean cost over the frames of the track, px of the footage; lost frames cost more."""


def fit_start(
    observer: Observer,
    models: Sequence[BodyModel],
    start: Array,
    frame: int,
    later: Sequence[Sequence[int]],
    others: Sequence[Array],
) -> FittedStart:
    """Fit the start pose of the first person to a frame, and track from it in several directions.

    Args:
        observer: of the recording.
        models: the body of each person.
        start: of the first person, (n_values,).
        frame: of the start.
        later: for each direction the frames of a short track, without the first.
        others: pose of each other person on that frame, (n_values,) each.
    """
    subjects = Subjects.of(models, [0])

    def estimates(pose: Array, frames: Sequence[int]) -> Iterator[PoseEstimate]:
        run = TrackingRun(observer, subjects, [pose, *others], frames)
        return ChamferTracker(TrackSettings(backward_pass=False)).estimates(run)

    (fitted,) = estimates(start, [frame])
    # A fit reaches only as far as its prior and the edges around its start. Starts that short tracks compare are few
    # enough to be fitted again.
    for _ in range(_MAX_FITS - 1 if later else 0):
        (again,) = estimates(fitted.poses[0], [frame])
        gained = fitted.cost_px - again.cost_px
        fitted = again if gained > 0 else fitted
        if not gained > _MIN_GAIN * fitted.cost_px:
            break
    pose, costs = fitted.poses[0], [_cost_px(fitted)]
    for frames in later:
        costs += [_cost_px(e) for e in estimates(pose, [frame, *frames]) if e.frame != frame]
    cost = float(np.mean(costs))
    return FittedStart(pose, fitted.statuses[0], cost if np.isfinite(cost) else np.inf)


def _cost_px(estimate: PoseEstimate) -> float:
    """Return the cost of a frame of the first person with what its status adds, px."""
    extra = {"lost": _LOST_PX, "doubtful": _DOUBTFUL_PX}.get(estimate.statuses[0], 0.0)
    return estimate.cost_px + extra
