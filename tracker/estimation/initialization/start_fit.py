"""Fit hypotheses of a start to a frame, track them a few frames in both directions, and score them there in nats.

In a wrong local minimum a limb keeps its place only until it moves. A short track that comes back may then end in the
right pose, which is another hypothesis.

Search around a fitted start: its limbs, exchanged limbs, and the directions that contours hardly determine.

A start from voxels or silhouettes is several degrees off in each joint, and often a limb is elsewhere. A fit then ends
in the local minimum next to it. Its cost and status look as good as those of the right pose.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.frame_problem import FrameProblem, PersonPrior
from tracker.estimation.by_frame.pose_score import common_evidence, scorer_without_prediction
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.by_frame.start_pose import MAX_ROUNDS, roughly_known, search_start
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.fitting.hypothesis import SAME_POSE_M, Hypothesis, distance_m
from tracker.estimation.tracking.confidence import Status
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.estimation.tracking.tracker import PoseEstimate, Subjects, TrackingRun
from tracker.estimation.tracking.view_regions import read_views
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array

_TRACK_STEPS = (2, 4, 6)
"""Frames after and before a start over which starts are compared."""
_SETTINGS = TrackSettings(whole_run=False)


class StartTrack(NamedTuple):
    """A hypothesis of a start, tracked over a few frames in both directions."""

    start: Hypothesis
    """On the frame of the start; its cost is that of all frames once tracks are compared."""
    status: Status
    """The tracker's status of the fit on the frame of the start."""
    cost_px: float
    """Mean chamfer cost of the frames, px of the footage. It is shown, and compares different frames."""
    poses: Mapping[int, Array]
    """By frame, the pose, (n_values,)."""
    is_lost: bool = False
    """Whether the person is lost on one of the frames."""
    returning: tuple[Iterator[PoseEstimate], ...] = ()
    """The ways back, which have not been tracked yet."""


@dataclass(frozen=True)
class StartFitter:
    """Fits, tracks and scores hypotheses of one person on a frame."""

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

    def fit(self, start: Hypothesis) -> Hypothesis:
        """Fit a start to the frame."""
        (found,) = self._estimates(start, [self.frame])
        return start.at(found.poses[0])

    def search(self, start: Hypothesis) -> Hypothesis:
        """Search around a start, and fit the result."""
        self.step()
        found = search_around(self.observer, (start.body, *self.others), self.frame, _SETTINGS)
        return self.fit(start.at(found.values))

    def track(self, start: Hypothesis) -> StartTrack:
        """Track from a start in all directions."""
        tracked, returning = list[PoseEstimate](), list[Iterator[PoseEstimate]]()
        for frames in self.later or ([],):
            way = self._estimates(start, [self.frame, *frames, *frames[-2::-1], self.frame][: 1 + 2 * len(frames)])
            tracked += islice(way, 1 + len(frames))
            returning.append(way)
        by_frame = {e.frame: e for e in tracked}
        own, cost_px = by_frame[self.frame], float(np.mean([e.cost_px for e in by_frame.values()]))
        is_lost = any(e.statuses[0] == "lost" for k, e in by_frame.items() if k != self.frame)
        poses = {k: e.poses[0] for k, e in by_frame.items()}
        return StartTrack(start.at(own.poses[0]), own.statuses[0], cost_px, poses, is_lost, tuple(returning))

    def scored(self, starts: Sequence[Hypothesis]) -> list[Hypothesis]:
        """Return hypotheses with their costs on the frame, all on common evidence, the best first."""
        costs = self._costs(self.frame, [s.body for s in starts])
        return sorted((replace(s, cost=c) for s, c in zip(starts, costs, strict=True)), key=lambda s: s.cost)

    def compared(self, tracks: Sequence[StartTrack]) -> list[StartTrack]:
        """Return tracks with the sums of their costs over all frames, on common evidence, the best first."""
        costs = np.sum(
            [
                self._costs(frame, [PosedBody(t.start.model, t.poses[frame]) for t in tracks])
                for frame in tracks[0].poses
            ],
            axis=0,
        )
        scored = [t._replace(start=replace(t.start, cost=c)) for t, c in zip(tracks, costs, strict=True)]
        return sorted(scored, key=lambda t: t.start.cost)

    def _costs(self, frame: int, bodies: Sequence[PosedBody]) -> Array:
        """Return the costs of one person in several poses, of bodies of any sizes, on common evidence, (n,), nats."""
        guesses = [(body, *self.others) for body in bodies]
        views = common_evidence(self.observer, frame, guesses, _SETTINGS)
        scorers = [scorer_without_prediction(views, guess, 0, _SETTINGS) for guess in guesses]
        return np.array([s.costs_with_priors(b.model, b.values[None])[0] for s, b in zip(scorers, bodies, strict=True)])

    def _estimates(self, start: Hypothesis, frames: Sequence[int]) -> Iterator[PoseEstimate]:
        people = (start.body, *self.others)
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


def track_back(track: StartTrack) -> tuple[list[Hypothesis], bool]:
    """Track back to the frame of a start.

    Returns:
        The poses that it comes back to and that are not the start; whether the person is lost there or back.
    """
    found, is_lost = list[Hypothesis](), track.is_lost
    for way in track.returning:
        *_, last = estimates = list(way)
        is_lost = is_lost or any(e.statuses[0] == "lost" for e in estimates)
        end = track.start.at(last.poses[0])
        if distance_m(track.start.body, end.body) > SAME_POSE_M:
            found.append(end)
    return found, is_lost


_N_DRAWS = 3
"""Draws of samples in each round."""


def search_around(
    observer: Observer, bodies: Sequence[PosedBody], frame: int, settings: EstimationSettings
) -> PosedBody:
    """Search around the start of the first person on a frame, and return the person in the cheapest pose.

    Args:
        observer: of the recording.
        bodies: all people; the others stay.
        frame: of the start.
        settings: of the tracker.
    """
    body, *others = bodies
    wide = roughly_known(settings)
    for _ in range(MAX_ROUNDS):
        everybody = (body, *others)
        priors = [PersonPrior(b.model, b.values) for b in everybody]
        problem = FrameProblem(read_views(observer, frame, everybody), priors, wide)
        memory = PersonMemory(body.model, body.values)
        before, (body, _) = body, search_start(problem, 0, everybody, memory, _N_DRAWS)
        if distance_m(before, body) < SAME_POSE_M:
            break
    return body
