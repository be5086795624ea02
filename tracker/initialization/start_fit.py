"""Fit start poses to the contours of a frame, and compare them by short tracks in both directions."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.confidence import Status
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_LOST_PX, _DOUBTFUL_PX = 2.0, 0.5
"""What a lost and a doubtful frame of a short track add to its cost, px."""


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
    pose, costs = start, list[float]()
    status: Status = "lost"
    for number, frames in enumerate([(), *later]):
        own = [frame, *frames]
        run = TrackingRun(observer, Subjects.of(models, [0]), [pose, *others], own)
        for estimate in ChamferTracker(TrackSettings(backward_pass=False)).estimates(run):
            found = estimate.statuses[0]
            extra = _LOST_PX if found == "lost" else _DOUBTFUL_PX if found == "doubtful" else 0.0
            if number == 0:
                pose, status = estimate.poses[0], found
            if number == 0 or estimate.frame != frame:
                costs.append(estimate.cost_px + extra)
    cost = float(np.mean(costs))
    return FittedStart(pose, status, cost if np.isfinite(cost) else np.inf)
