"""Replay recorded searches: show their steps and candidates, compare and take over their results."""

from dataclasses import replace

import numpy as np

from app.control.search.search_runs import SearchRun, SearchRuns
from app.control.session.activities import Activities
from app.control.session.comparing import leave_before
from app.control.session.session_state import SessionState
from app.state.people import ShownPose
from app.state.search import PreviewState, ReplayState, SearchView
from app.state.state import finite_or_none
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array


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
