"""Fit start poses to the contours of a frame, and compare them by short tracks in both directions.

In a wrong local minimum a limb keeps its place only until it moves. A short track that comes back may then end in the
right pose, which is another start.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.initialization.start_rivals import limbs_elsewhere
from tracker.initialization.start_search import search_around
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_LOST_PX, _DOUBTFUL_PX = 2.0, 0.5
"""Penalties for a lost and for a doubtful frame of a short track, px."""
_RETURNED_M = 0.05
"""A track comes back to another pose if a joint of a limb is farther from the start, metres."""
_TRACK_STEPS = (2, 4, 6)
"""Frames after and before a start over which starts are compared."""
_SETTINGS = TrackSettings(backward_pass=False)


class FittedStart(NamedTuple):
    """A start pose after the fit to contours."""

    pose: Array
    """(n_values,)."""
    status: Status
    """As the tracker gives it."""
    cost_px: float
    """Mean cost over the frames that were fitted, px of the footage; lost frames cost more."""
    is_lost: bool = False
    """Whether the person was lost on a short track."""
    returning: tuple[Iterator[PoseEstimate], ...] = ()
    """The ways back of short tracks, which have not been tracked yet."""


class Returned(NamedTuple):
    """The ends of short tracks that came back to the frame of a start."""

    poses: list[Array]
    """End poses that differ from the start, (n_values,) each."""
    is_lost: bool
    """Whether the person was lost on a short track, there or back."""


@dataclass(frozen=True)
class StartFitter:
    """Fits starts of one person on a frame."""

    observer: Observer
    """Of the recording."""
    frame: int
    """Of the starts."""
    later: Sequence[Sequence[int]]
    """For each direction the frames of a short track, without the first."""
    others: tuple[PosedBody, ...]
    """The other people on that frame."""
    step: Callable[[], None] = lambda: None
    """Called after each frame that is fitted and before each search. An exception that it raises ends the work."""

    def fit(self, start: PosedBody) -> FittedStart:
        """Fit a start to the frame."""
        (found,) = self._estimates(start, [self.frame])
        return FittedStart(found.poses[0], found.statuses[0], _cost_px(found))

    def search(self, start: PosedBody) -> FittedStart:
        """Search around a start, and fit the result twice."""
        self.step()
        fitted = self.fit(search_around(self.observer, (start, *self.others), self.frame, _SETTINGS))
        # A fit reaches only as far as its prior and the edges around its start.
        again = self.fit(PosedBody(start.model, fitted.pose))
        return again if again.cost_px < fitted.cost_px else fitted

    def track(self, start: PosedBody, fitted: FittedStart) -> FittedStart:
        """Track from a fitted start in all directions, and return it with the cost of all these frames.

        Args:
            start: the body in the fitted pose.
            fitted: the fit.
        """
        tracked, returning = list[PoseEstimate](), list[Iterator[PoseEstimate]]()
        for frames in self.later:
            way = self._estimates(start, [self.frame, *frames, *frames[-2::-1], self.frame])
            _, *found = islice(way, 1 + len(frames))
            tracked += found
            returning.append(way)
        cost = float(np.mean([fitted.cost_px, *map(_cost_px, tracked)]))
        is_lost = any(_is_lost(e) for e in tracked)
        return FittedStart(fitted.pose, fitted.status, cost if np.isfinite(cost) else np.inf, is_lost, tuple(returning))

    def _estimates(self, start: PosedBody, frames: Sequence[int]) -> Iterator[PoseEstimate]:
        people = (start, *self.others)
        subjects = Subjects.of([b.model for b in people], [0])
        # A pose and the same one before it are a prediction: the tracker does not search around it a second time.
        run = TrackingRun(self.observer, subjects, [[b.values, b.values] for b in people], frames)
        for estimate in ChamferTracker(_SETTINGS).estimates(run):
            self.step()
            yield estimate


def short_tracks(frame: int, n_frames: int) -> list[list[int]]:
    """Return the frames of the short tracks from a frame of a recording, forward and backward."""
    both = [[frame + sign * d for d in _TRACK_STEPS] for sign in (1, -1)]
    return [own for frames in both if (own := [k for k in frames if 0 <= k < n_frames])]


def track_back(start: PosedBody, fitted: FittedStart) -> Returned:
    """Track back to the frame of a start.

    Args:
        start: the body in the fitted pose.
        fitted: the fit, whose short tracks have not come back yet.
    """
    poses, is_lost = list[Array](), fitted.is_lost
    for way in fitted.returning:
        *_, last = found = list(way)
        is_lost = is_lost or any(_is_lost(e) for e in found)
        if limbs_elsewhere(start.model, start.points_world, start.model.points_world(last.poses[0]), _RETURNED_M):
            poses.append(last.poses[0])
    return Returned(poses, is_lost)


def _is_lost(estimate: PoseEstimate) -> bool:
    return estimate.statuses[0] == "lost"


def _cost_px(estimate: PoseEstimate) -> float:
    """Return the cost of a frame of the first person with what its status adds, px."""
    extra = {"lost": _LOST_PX, "doubtful": _DOUBTFUL_PX}.get(estimate.statuses[0], 0.0)
    return estimate.cost_px + extra
