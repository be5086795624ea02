"""Fit start poses to the contours of a frame, and choose among them."""

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

_RANK: dict[Status, int] = {"good": 0, "doubtful": 1, "lost": 2}
_LOST_PX, _DOUBTFUL_PX = 2.0, 0.5
"""What a lost and a doubtful frame of a short track add to its cost, px."""


class FittedStart(NamedTuple):
    """A start pose after the fit to contours."""

    pose: Array
    """(n_values,)."""
    status: Status
    """As the tracker gives it."""
    cost_px: float
    """Mean cost over the frames of a short track, px of the footage; lost frames cost more."""
    start: int
    """Index of the start that it came from."""


def fit_starts(
    observer: Observer,
    models: Sequence[BodyModel],
    person: int,
    starts: Sequence[Array],
    frames: Sequence[int],
    others: Sequence[Array],
) -> FittedStart:
    """Fit several start poses to the first of some frames, track each over the others, and return the cheapest.

    Args:
        observer: of the recording.
        models: the body of each person.
        person: index of the person.
        starts: start poses, (n_values,) each.
        frames: the frame of the start, and those of a short track; at least one.
        others: pose of each person on that frame; that of the person is not used.
    """
    found = []
    for index, start in enumerate(starts):
        poses = [start if i == person else p for i, p in enumerate(others)]
        run = TrackingRun(observer, Subjects.of(models, [person]), poses, frames)
        estimates = list(ChamferTracker(TrackSettings(backward_pass=False)).estimates(run))
        first, cost = estimates[0], 0.0
        for estimate in estimates:
            status = estimate.statuses[person]
            cost += estimate.cost_px + (_LOST_PX if status == "lost" else _DOUBTFUL_PX if status == "doubtful" else 0.0)
        found.append(FittedStart(first.poses[person], first.statuses[person], cost / len(estimates), index))
    return min(found, key=lambda f: (f.cost_px if np.isfinite(f.cost_px) else np.inf, _RANK[f.status]))
