"""Record every step of the last searches, so that they can be replayed and compared.

Replay recorded searches: show their steps and candidates, compare and take over their results.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.control.session.activities import Activities
from app.control.session.comparing import leave_before
from app.control.session.session_state import SessionState
from app.state.people import ShownPose
from app.state.search import PreviewState, ReplayState, SearchView
from app.state.state import finite_or_none
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchStep, Stage, stages
from tracker.geometry.arrays import Array, FloatArray

MAX_STEPS = 10_000
"""Maximum number of recorded steps of a run; beyond, every other step without improvement is discarded."""
_MAX_RUNS = 6
"""Maximum number of recorded runs of a frame."""
_MAX_FRAMES = 8
"""Maximum number of frames with recorded runs."""
_MAX_CANDIDATES = 8
"""Length of the list of the best candidates."""
_DISTINCT_M = 0.03
"""Poses are distinct if a point differs by this distance, metres."""


class RecordedStep(NamedTuple):
    """One expansion, in compact form: thousands are recorded."""

    stage: int
    """Index among the run's stages."""
    evaluations: int
    """Poses scored since the run began."""
    candidate_px: float
    """Cost of the best pose of this expansion, px."""
    best_px: float
    """Lowest cost so far, px."""
    candidate: FloatArray
    """Values of all people, concatenated, for the best pose of this expansion."""
    best: FloatArray
    """Values of all people, concatenated, for the best poses so far."""
    matters: bool
    """Whether the step lowered the cost or ended its stage; such steps are never discarded."""


class Candidate(NamedTuple):
    """One of the best poses of a search."""

    px: float
    """Cost, px."""
    poses: tuple[Array, ...]
    """Pose of each person, (n_values,) each."""
    points_world: Array
    """All points of all people, (N, 3), metres."""


class StageCount(NamedTuple):
    """Work and gain of a stage so far."""

    expansions: int
    evaluations: int
    gain_px: float
    """Decrease of the cost, px."""
    done: bool


class SearchRun:
    """One recorded search of one frame. The caller holds the session's lock."""

    def __init__(
        self,
        frame: int,
        models: Sequence[BodyModel],
        start: tuple[Array, ...],
        start_px: float,
        settings: TrackSettings,
        free: Sequence[NDArray[np.bool_]] | None = None,
        planned: Sequence[Stage] | None = None,
    ) -> None:
        """Begin without steps.

        Args:
            frame: index of the searched frame.
            models: the body of each person.
            start: pose of each person before the search, (n_values,) each.
            start_px: their cost, px; NaN if unknown.
            settings: of the search.
            free: of each person the degrees of freedom that may move, (n_dofs,); all by default.
            planned: stages of a fit of contours; None for those of a search.
        """
        self.frame, self.start, self.settings = frame, start, settings
        self.number = 0
        """Unique in the session, from 1; `SearchRuns.add` gives it."""
        self.is_contour_fit = planned is not None
        """Whether the steps are iterations of a fit of contours."""
        self.stages = stages(models, settings.search, active_dofs=free) if planned is None else list(planned)
        self.counts = [StageCount(0, 0, 0.0, False) for _ in self.stages]
        self.steps: list[RecordedStep] = []
        self.best, self.best_px = start, start_px
        self.end_px = start_px
        """Cost of the best poses, px. A running search compares poses by the edges near its start: then it is that."""
        self.start_px, self.evaluations, self.seconds = start_px, 0, 0.0
        self.over = False
        """Whether the run has ended."""
        self.thinned = 0
        """Number of times that steps were discarded."""
        self.candidates: list[Candidate] = []
        """The best distinct poses, lowest cost first."""
        self.version = 0
        """Increases with every step."""
        self._models = tuple(models)
        self._lengths = [len(p) for p in start]
        self._at = -1
        self._stage: Stage | None = None
        self._best_row = np.concatenate(start).astype(np.float32)

    def add(self, step: SearchStep, seconds: float) -> None:
        """Record a step.

        Args:
            step: of the search.
            seconds: time worked since the run began.
        """
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
                self._at, step.evaluations, step.candidate_px, step.best_px,
                np.concatenate(step.candidate).astype(np.float32), self._best_row, better or step.stage_done,
            )
        )  # fmt: skip
        self.best, self.best_px, self.end_px = step.best, step.best_px, step.best_px
        self.evaluations, self.seconds, self.version = step.evaluations, seconds, self.version + 1
        self._list(step.candidate_px, step.candidate)
        if len(self.steps) > MAX_STEPS:
            self._thin()

    def rest(self, cost_px: float | None) -> None:
        """Note the cost of the best poses, px, where the search pauses or ends; None if it is not known."""
        self.end_px, self.version = self.best_px if cost_px is None else cost_px, self.version + 1

    def poses_of(self, row: FloatArray) -> tuple[Array, ...]:
        """Return the pose of each person from the values of a recorded step."""
        return tuple(np.split(row.astype(np.float64), np.cumsum(self._lengths)[:-1]))

    def _list(self, px: float, poses: tuple[Array, ...]) -> None:
        """Add poses to the list of the best, unless a better entry is not distinct from them."""
        if len(self.candidates) == _MAX_CANDIDATES and px >= self.candidates[-1].px:
            return
        points = np.concatenate([m.points_world(p) for m, p in zip(self._models, poses, strict=True)])
        near = [c for c in self.candidates if np.linalg.norm(c.points_world - points, axis=1).max() < _DISTINCT_M]
        if any(c.px <= px for c in near):
            return
        survivors = [c for c in self.candidates if all(c is not n for n in near)]
        self.candidates = sorted([*survivors, Candidate(px, poses, points)], key=lambda c: c.px)[:_MAX_CANDIDATES]

    def _thin(self) -> None:
        survivors = [s for i, s in enumerate(self.steps) if s.matters or i % 2 == 0]
        self.steps = survivors if len(survivors) <= 0.9 * MAX_STEPS else self.steps[1::2]
        self.thinned += 1


class SearchRuns:
    """The recorded runs of the frames searched last. The caller holds the session's lock."""

    def __init__(self) -> None:
        """Begin without runs."""
        self._runs: dict[int, list[SearchRun]] = {}
        self._number = 0
        self.on_discard: Callable[[], None] = lambda: None
        """Called after runs were discarded."""

    def add(self, run: SearchRun) -> SearchRun:
        """Add a run, in place of the oldest if there are too many, and return it with its number."""
        self._number = run.number = self._number + 1
        of_frame = self._runs.pop(run.frame, [])
        self._runs[run.frame] = [*of_frame, run][-_MAX_RUNS:]  # as the newest frame of the dict
        while len(self._runs) > _MAX_FRAMES:
            del self._runs[next(iter(self._runs))]
        self.on_discard()
        return run

    def clear(self) -> None:
        """Discard all runs."""
        self._runs.clear()
        self.on_discard()

    def of_frame(self, frame: int) -> list[SearchRun]:
        """Return the runs of a frame, oldest first."""
        return list(self._runs.get(frame, []))

    def find(self, number: int) -> SearchRun | None:
        """Return the run of a number; None if it is discarded."""
        return next((r for runs in self._runs.values() for r in runs if r.number == number), None)


class Replay:
    """Views of recorded runs. They change no stored pose; taking over a result is an edit."""

    def __init__(self, session_state: SessionState, runs: SearchRuns, activities: Activities) -> None:
        """Replay nothing yet.

        Args:
            session_state: holds the state.
            runs: the recorded searches.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._runs, self._activities = session_state, runs, activities
        activities.add_gesture(self.leave)
        runs.on_discard = self._forget_discarded

    def runs(self) -> list[SearchRun]:
        """Return the runs of the shown frame, oldest first; the caller holds the session's lock."""
        return self._runs.of_frame(self._session_state.state.frame)

    def show(self, number: int, step: int) -> None:
        """Show a recorded step in place of the stored poses.

        Args:
            number: of the run.
            step: index of the step; negative for the start of the run, the last step if it is too large.

        Raises:
            TrackerError: the run is discarded, or a search is running.
        """
        with self._session_state.lock:
            run = self._run(number)
            if self._session_state.state.search.running:
                raise TrackerError("expected no running search during a replay, found one; stop it first (Esc)")
            at, candidate, best, stage = min(max(-1, step), len(run.steps) - 1), None, run.start, None
            px, evaluations, fitted_from = finite_or_none(run.start_px), 0, run.start if run.is_contour_fit else None
            if at >= 0:
                recorded = run.steps[at]
                candidate = None if run.is_contour_fit else run.poses_of(recorded.candidate)
                best, stage = run.poses_of(recorded.best), run.stages[recorded.stage].name
                px, evaluations = recorded.candidate_px, recorded.evaluations
            costs = vars(self._session_state.costs(best))
            shown = ReplayState(
                number, at, len(run.steps), candidate, best, stage, px, evaluations, **costs, fitted_from=fitted_from
            )
            leave_before(self._session_state)
            self._set_view(replace(self._view, replay=shown, preview=None))

    def leave(self) -> None:
        """Show the stored poses again; called before any change of the frame."""
        with self._session_state.lock:
            if self._view.replay is not None or self._view.preview is not None:
                self._set_view(replace(self._view, replay=None, preview=None))

    def compare(self, number: int | None) -> None:
        """Draw the result of a run over the views; None ends this.

        Raises:
            TrackerError: the run is discarded.
        """
        with self._session_state.lock:
            compared = None if number is None else self._run(number).best
            self._set_view(replace(self._view, compared=compared, compared_run=number))

    def preview(self, number: int, candidate: int | None) -> None:
        """Draw a candidate of a run over the views; None, or an outdated index, draws none."""
        with self._session_state.lock:
            run = self._runs.find(number)
            shown = None
            if run is not None and candidate is not None and 0 <= candidate < len(run.candidates):
                shown = PreviewState(number, candidate, run.candidates[candidate].poses)
            self._set_view(replace(self._view, preview=shown))

    def take(self, number: int, candidate: int | None) -> None:
        """Take over a candidate of a run, or its result if the candidate is None; one entry of the history.

        Raises:
            TrackerError: the run or the candidate is discarded.
        """
        with self._session_state.lock:
            run = self._run(number)
            if candidate is not None and not 0 <= candidate < len(run.candidates):
                raise TrackerError(
                    f"expected one of {len(run.candidates)} candidates, found number {candidate + 1}; choose another"
                )
            poses = run.best if candidate is None else run.candidates[candidate].poses
        label = f"take run {number}" if candidate is None else f"take candidate {candidate + 1} of run {number}"
        with self._activities.editing():
            if run.frame == self._session_state.state.frame:
                self._adopt(poses, label)

    def _forget_discarded(self) -> None:
        """End replay, preview and comparison of runs that are no longer recorded."""
        with self._session_state.lock:
            view = self._view
            if view.compared_run is not None and self._runs.find(view.compared_run) is None:
                view = replace(view, compared=None, compared_run=None)
            if view.preview is not None and self._runs.find(view.preview.run) is None:
                view = replace(view, preview=None)
            if view.replay is not None and self._runs.find(view.replay.run) is None:
                view = replace(view, replay=None)
            if view is not self._view:
                self._set_view(view)

    def _adopt(self, poses: tuple[Array, ...], label: str) -> None:
        session_state = self._session_state
        poses = session_state.within_locks(poses)
        people = tuple(
            p if p.source is not None and np.array_equal(p.values, new) else ShownPose(new, "searched")
            for p, new in zip(session_state.state.people, poses, strict=True)
        )
        session_state.set(people=people, **vars(session_state.costs(poses)))
        session_state.save(label, "searched")

    def _run(self, number: int) -> SearchRun:
        run = self._runs.find(number)
        if run is None or run.frame != self._session_state.state.frame:
            raise TrackerError(
                f"expected a recorded run of frame {self._session_state.state.frame}, found run {number}, "
                "which is discarded; choose another from the list"
            )
        return run

    @property
    def _view(self) -> SearchView:
        return self._session_state.state.search_view

    def _set_view(self, view: SearchView) -> None:
        self._session_state.set(search_view=view)
