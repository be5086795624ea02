"""Searches as they went: every step of the last few runs, kept so that they can be replayed and compared."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, FloatArray
from tracker.search.best_first import SearchStep, Stage, stages
from tracker.tracking.chamfer.settings import TrackSettings

KEPT_STEPS = 10_000
"""Steps of a run that are kept at most; beyond, every other one that found nothing better is dropped."""
_KEPT_RUNS = 6
"""Runs of a frame that are kept."""
_KEPT_FRAMES = 8
"""Frames whose runs are kept."""
_MOST_CANDIDATES = 8
"""Poses in the list of the best candidates."""
_DISTINCT_M = 0.03
"""Poses count as one unless a point lies this far apart, metres."""


class RecordedStep(NamedTuple):
    """One expansion, small enough to be kept by the thousand."""

    stage: int
    """Index among the run's stages."""
    evaluations: int
    """Poses scored since the run began."""
    candidate_px: float
    """Cost of the cheapest pose just scored, px."""
    best_px: float
    """Least cost so far, px."""
    best_views_px: FloatArray
    """The same in each view, (V,), px; NaN for views without edges."""
    candidate: FloatArray
    """Values of all people, one after the other, with the cheapest pose just scored."""
    best: FloatArray
    """The same with the best poses so far."""
    matters: bool
    """Whether it found something better or ended its stage: such steps are never thinned out."""


class Candidate(NamedTuple):
    """A good pose that a search came by."""

    px: float
    """Its cost, px."""
    poses: tuple[Array, ...]
    """Pose of each person, (n_values,) each."""
    points_world: Array
    """All points of all people, (N, 3), metres."""


class StageCount(NamedTuple):
    """What a stage has cost and brought so far."""

    expansions: int
    evaluations: int
    gain_px: float
    """By how much it lowered the cost, px."""
    done: bool


class SearchRun:
    """One search of one frame. Not locked by itself: whoever holds it holds the screen's lock."""

    def __init__(
        self,
        number: int,
        frame: int,
        models: Sequence[BodyModel],
        start: tuple[Array, ...],
        start_px: float,
        settings: TrackSettings,
        free: Sequence[NDArray[np.bool_]] | None = None,
    ) -> None:
        """Begin with no step taken.

        Args:
            number: of the run, from 1 on, never used again.
            frame: that is searched.
            models: the body of each person.
            start: pose of each person before the search, (n_values,) each.
            start_px: their cost, px; NaN where it is not known.
            settings: what the search is told.
            free: of each person the degrees of freedom that may move, (n_dofs,); all by default.
        """
        self.number, self.frame, self.start, self.settings = number, frame, start, settings
        self.stages: list[Stage] = stages(models, settings.search, free=free)
        self.counts = [StageCount(0, 0, 0.0, False) for _ in self.stages]
        self.steps: list[RecordedStep] = []
        self.best, self.best_px = start, start_px
        self.start_px, self.evaluations, self.seconds = start_px, 0, 0.0
        self.over = False
        """Whether it goes on no more."""
        self.thinned = 0
        """How often steps were thinned out."""
        self.candidates: list[Candidate] = []
        """The best poses that differ, the cheapest first."""
        self.version = 0
        """Rises with every step."""
        self._models = tuple(models)
        self._lengths = [len(p) for p in start]
        self._at = -1
        self._stage: Stage | None = None
        self._best_row = np.concatenate(start).astype(np.float32)

    def add(self, step: SearchStep, seconds: float) -> None:
        """Take down a step; `seconds` is the time worked since the run began."""
        if step.stage is not self._stage:
            self._stage, self._at = step.stage, self._at + 1
        former_px = step.best_px if np.isnan(self.best_px) else self.best_px
        better = step.best_px < former_px
        count = self.counts[self._at]
        self.counts[self._at] = StageCount(
            count.expansions + 1,
            count.evaluations + step.evaluations - self.evaluations,
            count.gain_px + former_px - step.best_px,
            step.stage_done,
        )
        if better:
            self._best_row = np.concatenate(step.best).astype(np.float32)
        if np.isnan(self.start_px):
            self.start_px = step.best_px
        self.steps.append(
            RecordedStep(
                self._at, step.evaluations, step.candidate_px, step.best_px, step.best_views_px.astype(np.float32),
                np.concatenate(step.candidate).astype(np.float32), self._best_row, better or step.stage_done,
            )
        )  # fmt: skip
        self.best, self.best_px = step.best, step.best_px
        self.evaluations, self.seconds, self.version = step.evaluations, seconds, self.version + 1
        self._list(step.candidate_px, step.candidate)
        if len(self.steps) > KEPT_STEPS:
            self._thin()

    def poses_of(self, row: FloatArray) -> tuple[Array, ...]:
        """Pose of each person from a row of a recorded step."""
        return tuple(np.split(row.astype(np.float64), np.cumsum(self._lengths)[:-1]))

    def _list(self, px: float, poses: tuple[Array, ...]) -> None:
        """Put a pose among the best, unless a better one is nearly the same."""
        if len(self.candidates) == _MOST_CANDIDATES and px >= self.candidates[-1].px:
            return
        points = np.concatenate([m.points_world(p) for m, p in zip(self._models, poses, strict=True)])
        near = [c for c in self.candidates if np.linalg.norm(c.points_world - points, axis=1).max() < _DISTINCT_M]
        if any(c.px <= px for c in near):
            return
        kept = [c for c in self.candidates if all(c is not n for n in near)]
        self.candidates = sorted([*kept, Candidate(px, poses, points)], key=lambda c: c.px)[:_MOST_CANDIDATES]

    def _thin(self) -> None:
        kept = [s for i, s in enumerate(self.steps) if s.matters or i % 2 == 0]
        self.steps = kept if len(kept) <= 0.9 * KEPT_STEPS else self.steps[1::2]
        self.thinned += 1


class SearchRuns:
    """The runs of the frames searched last. Locked as a `SearchRun` is."""

    def __init__(self) -> None:
        """Begin with none."""
        self._runs: dict[int, list[SearchRun]] = {}
        self._number = 0

    def begin(
        self,
        frame: int,
        models: Sequence[BodyModel],
        start: tuple[Array, ...],
        start_px: float,
        settings: TrackSettings,
        free: Sequence[NDArray[np.bool_]] | None = None,
    ) -> SearchRun:
        """Note that a search begins; the oldest run makes room. See `SearchRun`."""
        self._number += 1
        run = SearchRun(self._number, frame, models, start, start_px, settings, free)
        of_frame = self._runs.pop(frame, [])
        self._runs[frame] = [*of_frame, run][-_KEPT_RUNS:]  # this frame now is the newest of the dict
        while len(self._runs) > _KEPT_FRAMES:
            del self._runs[next(iter(self._runs))]
        return run

    def clear(self) -> None:
        """Keep none of them any more."""
        self._runs.clear()

    def of_frame(self, frame: int) -> list[SearchRun]:
        """Runs of a frame, the oldest first."""
        return list(self._runs.get(frame, []))

    def find(self, number: int) -> SearchRun | None:
        """The run of a number; None where it is kept no more."""
        return next((r for runs in self._runs.values() for r in runs if r.number == number), None)
