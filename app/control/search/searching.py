"""The search on the shown frame: step by step or to its end, watched, stopped, saved."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from app.control.search.search_runs import Run, Runs
from app.control.session.session_state import Screen
from app.runtime.jobs import Job
from app.state.state import JobState, Shown, finite_or_none
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.search.best_first import SearchStep, stages
from tracker.tracking.chamfer.settings import search_frame
from tracker.tracking.subjects import Subjects

_SAVE_S = 0.5
"""A running search is on disk at least this often."""


class Searching:
    """At most one search, which runs or stands on the shown frame."""

    def __init__(self, screen: Screen, runs: Runs) -> None:
        """Search what is on this screen, and take down in `runs` how it went."""
        self._screen, self._runs = screen, runs
        self._job: Job[SearchStep] | None = None
        self._run: Run | None = None
        self._person: int | None = None  # who alone is searched; None for everybody

    @property
    def running(self) -> bool:
        """Whether a search is at work."""
        return self._job is not None and self._job.running

    def step(self, person: int | None = None) -> None:
        """Do one expansion, beginning a search where none of the same people stands; by default of everybody."""
        with self._screen.lock:
            if not self.running:
                self._standing_job(person).step()

    def run(self, person: int | None = None) -> None:
        """Search to the end, going on with a search of the same people that stands; by default of everybody."""
        self._go(lambda _: False, person)

    def run_stage(self, person: int | None = None) -> None:
        """Search to the end of the stage at hand, which is the next one where a stage has just ended."""
        self._go(lambda step: step.stage_done, person)

    def run_again(self, number: int | None, person: int | None = None) -> None:
        """Search anew from where a run of this frame began, by the settings of now; None for the newest run.

        Raises:
            TrackerError: the run is kept no more.
        """
        with self._screen.lock:
            runs = self._runs.of_frame(self._screen.state.frame)
            if number is not None:
                runs = [r for r in runs if r.number == number]
                if not runs:
                    raise TrackerError(f"expected a run of this frame, found run {number}, which is kept no more")
            if not self.running:
                self.forget()
                self._go(lambda _: False, person, runs[-1].start if runs else None)

    def pace(self, speed: float | None) -> None:
        """Watch so many expansions a second, at once; None for as many as there can be.

        Raises:
            TrackerError: the speed is no positive number.
        """
        if speed is not None and not (np.isfinite(speed) and speed > 0):
            raise TrackerError(f"expected a speed above 0 expansions a second, found {speed:g}; choose another")
        with self._screen.lock:
            self._screen.set(look=replace(self._screen.state.look, speed=speed))
            if self._job is not None:
                self._job.pace(_rest_s(speed))

    def halt(self) -> None:
        """Stop a running search, which then stands; must not be called holding the lock, which its last step takes."""
        job = self._job
        if job is not None:
            job.stop()

    def forget(self) -> None:
        """Let no search stand any more; its steps are taken no notice of."""
        self._job = None
        if self._run is not None:
            self._run.over = True
        self._screen.set(job=JobState())

    def _go(
        self, until: Callable[[SearchStep], bool], person: int | None, start: tuple[Array, ...] | None = None
    ) -> None:
        with self._screen.lock:
            if not self.running:
                job = self._standing_job(person, start)
                self._screen.set(job=replace(self._screen.state.job, running=True))
                job.run(until)

    def _standing_job(self, person: int | None, start: tuple[Array, ...] | None = None) -> Job[SearchStep]:
        """The search that stands, or a new one from given poses, else from those shown."""
        screen, state = self._screen, self._screen.state
        if self._job is None or self._job.ended or self._person != person:
            frame, settings, models = state.frame, state.settings, screen.models
            poses = state.poses if start is None else screen.within_locks(start)
            free = [screen.free(i) & (person is None or i == person) for i in range(len(models))]
            if not stages(models, settings.search, free=free):
                raise TrackerError(
                    "expected something that a search may move, found everything locked; unlock some of it"
                )
            if self._run is not None:
                self._run.over = True
            start_px = screen.costs(poses)["cost_px"]
            known_px = start_px if isinstance(start_px, float) else np.nan
            run = self._runs.begin(frame, models, poses, known_px, settings, free)
            subjects = Subjects.of(models, active_dofs=free)
            job: Job[SearchStep] = Job(
                lambda: search_frame(screen.frames.evidence(frame), subjects, poses, settings),
                lambda step, seconds: self._stepped(job, step, seconds),
                lambda error: self._ended(job, error),
                lambda: self._paused(job),
            )
            job.pace(_rest_s(state.look.speed))
            self._job, self._run, self._person, screen.edit_of = job, run, person, None
            screen.set(job=JobState(kind="search", stages=tuple(s.name for s in run.stages)))
        return self._job

    def _stepped(self, job: Job[SearchStep], step: SearchStep, seconds: float) -> None:
        screen = self._screen
        with screen.lock:
            if job is not self._job or self._run is None:
                return
            self._run.add(step, seconds)
            people = tuple(
                p if self._is_left(i) or (p.source is not None and np.array_equal(p.values, best))
                else Shown(best, "searched")
                for i, (p, best) in enumerate(zip(screen.state.people, step.best, strict=True))
            )  # fmt: skip
            shown = replace(
                screen.state.job, running=job.running, kind="search", stage=step.stage.name,
                evaluations=step.evaluations, per_second=step.evaluations / max(1e-6, seconds),
                best_px=step.best_px, candidate=step.candidate, message="",
            )  # fmt: skip
            changed = any(a is not b for a, b in zip(people, screen.state.people, strict=True))
            costs = {"cost_px": step.best_px, "view_costs_px": tuple(finite_or_none(c) for c in step.best_views_px)}
            screen.set(people=people, job=shown, **costs)
            if changed and time.monotonic() - screen.last_save > _SAVE_S:
                screen.save("search", "searched", job)

    def _paused(self, job: Job[SearchStep]) -> None:
        with self._screen.lock:
            if job is self._job:
                self._screen.set(job=replace(self._screen.state.job, running=False))
                self._save(job)

    def _ended(self, job: Job[SearchStep], error: Exception | None) -> None:
        screen = self._screen
        with screen.lock:
            if job is not self._job or self._run is None:
                return
            self._run.over = True
            if error is None:
                message = f"done: {screen.state.job.evaluations} poses scored"
            else:
                message = str(error) if isinstance(error, TrackerError) else f"the search failed: {error}"
            ended = replace(screen.state.job, running=False, kind=None, stage=None, candidate=None, message=message)
            screen.set(job=ended, **screen.costs(screen.state.poses))
            self._save(job)

    def _is_left(self, person: int) -> bool:
        """Whether somebody else is searched and this person, who hides and explains, stays as he is: a draft too."""
        return self._person is not None and person != self._person

    def _save(self, job: Job[SearchStep]) -> None:
        if any(p.source == "searched" for p in self._screen.state.people):
            self._screen.save("search", "searched", job)


def _rest_s(speed: float | None) -> float:
    """Rest after each expansion, seconds; none at full speed."""
    return 0.0 if speed is None else 1.0 / speed
