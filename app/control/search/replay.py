"""Looking back at searches: their steps one by one, their candidates, their results beside one another."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from app.control.search.search_runs import Run, Runs
from app.control.session.session_state import Screen
from app.state.state import ReplayState, Shown, finite_or_none
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array


class Replay:
    """What is looked at of the recorded runs. Looking changes no stored pose; taking one over is an edit."""

    def __init__(self, screen: Screen, runs: Runs, editing: Callable[[], AbstractContextManager[None]]) -> None:
        """Look at nothing yet.

        Args:
            screen: holds the state.
            runs: what has been recorded.
            editing: gives the lock with nothing at work and no gesture at hand (`Controller.editing`).
        """
        self._screen, self._runs, self._editing = screen, runs, editing

    def runs(self) -> list[Run]:
        """The runs of the shown frame, the oldest first; hold the screen's lock to read them."""
        return self._runs.of_frame(self._screen.state.frame)

    def show(self, number: int, step: int) -> None:
        """Show a recorded step in place of the true poses; before the first it is the start, beyond the last the last.

        Raises:
            TrackerError: the run is kept no more, or is still at work.
        """
        with self._screen.lock:
            run = self._run(number)
            if self._screen.state.job.running:
                raise TrackerError(
                    "expected a search that is over or stands to replay, found one at work; stop it first (Esc)"
                )
            at = min(max(-1, step), len(run.steps) - 1)
            if at < 0:
                costs: tuple[float | None, ...] = ()
                shown = ReplayState(
                    number, -1, len(run.steps), None, run.start, None, finite_or_none(run.start_px),
                    finite_or_none(run.start_px), costs, 0,
                )  # fmt: skip
            else:
                kept = run.steps[at]
                shown = ReplayState(
                    number, at, len(run.steps), run.poses_of(kept.candidate), run.poses_of(kept.best),
                    run.stages[kept.stage].name, kept.candidate_px, kept.best_px,
                    tuple(finite_or_none(float(c)) for c in kept.best_views_px), kept.evaluations,
                )  # fmt: skip
            self._look(replay=shown, preview=None)

    def leave(self) -> None:
        """Show the true poses again; called before anything else happens to the frame."""
        with self._screen.lock:
            if self._screen.state.look.replay is not None or self._screen.state.look.preview is not None:
                self._look(replay=None, preview=None)

    def forget(self) -> None:
        """Compare no more either: another frame is shown."""
        with self._screen.lock:
            self._look(replay=None, preview=None, compared=None, compared_run=None)

    def compare(self, number: int | None) -> None:
        """Draw the result of a run over the views; None for no more.

        Raises:
            TrackerError: the run is kept no more.
        """
        with self._screen.lock:
            self._look(compared=None if number is None else self._run(number).best, compared_run=number)

    def preview(self, number: int, candidate: int | None) -> None:
        """Draw a candidate of a run over the views; None for no more, and for one that is no candidate any more."""
        with self._screen.lock:
            run = self._runs.find(number)
            is_there = run is not None and candidate is not None and 0 <= candidate < len(run.candidates)
            self._look(preview=run.candidates[candidate].poses if run and candidate is not None and is_there else None)

    def take(self, number: int, candidate: int | None) -> None:
        """Take over a candidate of a run, or its result where that is None: one edit, which can be undone.

        Raises:
            TrackerError: the run or the candidate is kept no more.
        """
        with self._screen.lock:
            run = self._run(number)
            if candidate is not None and not 0 <= candidate < len(run.candidates):
                raise TrackerError(
                    f"expected one of {len(run.candidates)} candidates, found number {candidate + 1}; choose another"
                )
            poses = run.best if candidate is None else run.candidates[candidate].poses
        label = f"take run {number}" if candidate is None else f"take candidate {candidate + 1} of run {number}"
        with self._editing():
            if run.frame == self._screen.state.frame:
                self._adopt(poses, label)

    def _adopt(self, poses: tuple[Array, ...], label: str) -> None:
        screen = self._screen
        poses = screen.within_locks(poses)
        people = tuple(
            p if p.source is not None and np.array_equal(p.values, new) else Shown(new, "searched")
            for p, new in zip(screen.state.people, poses, strict=True)
        )
        screen.set(people=people, **screen.costs(poses))
        screen.save(label, "searched")

    def _run(self, number: int) -> Run:
        run = self._runs.find(number)
        if run is None or run.frame != self._screen.state.frame:
            raise TrackerError(
                f"expected a run of frame {self._screen.state.frame}, found run {number}, which is kept no more; "
                "choose another from the list"
            )
        return run

    def _look(self, **changes: object) -> None:
        self._screen.set(look=replace(self._screen.state.look, **changes))  # type: ignore[arg-type]
