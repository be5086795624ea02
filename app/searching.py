"""The search on the shown frame: step by step or to its end, watched, stopped, saved."""

import time
from dataclasses import replace

import numpy as np

from app.jobs import Job
from app.screen import Screen
from app.state import JobState, Shown, finite_or_none
from tracker.errors import TrackerError
from tracker.search import SearchStep, stages
from tracker.track import search_frame

_SAVE_S = 0.5
"""A running search is on disk at least this often."""


class Searching:
    """At most one search, which runs or stands on the shown frame."""

    def __init__(self, screen: Screen) -> None:
        """Search what is on this screen."""
        self._screen = screen
        self._job: Job[SearchStep] | None = None

    @property
    def running(self) -> bool:
        """Whether a search is at work."""
        return self._job is not None and self._job.running

    def step(self) -> None:
        """Do one expansion, beginning a search where none stands."""
        with self._screen.lock:
            if not self.running:
                self._standing_job().step()

    def run(self) -> None:
        """Search to the end, going on with a search that stands."""
        with self._screen.lock:
            if not self.running:
                job = self._standing_job()
                self._screen.set(job=replace(self._screen.state.job, running=True))
                job.run()

    def halt(self) -> None:
        """Stop a running search, which then stands; must not be called holding the lock, which its last step takes."""
        job = self._job
        if job is not None:
            job.stop()

    def forget(self) -> None:
        """Let no search stand any more; its steps are taken no notice of."""
        self._job = None
        self._screen.set(job=JobState())

    def _standing_job(self) -> Job[SearchStep]:
        """The search that stands, or a new one from the poses shown."""
        screen, state = self._screen, self._screen.state
        if self._job is None or self._job.ended:
            frame, poses, settings = state.frame, state.poses, state.settings
            free = [screen.free(person) for person in range(len(screen.models))]
            standing = stages(screen.models, settings.search, free=free)
            if not standing:
                raise TrackerError(
                    "expected something that a search may move, found everything locked; unlock some of it"
                )
            job: Job[SearchStep] = Job(
                lambda: search_frame(screen.frames.evidence(frame), screen.models, poses, settings, free=free),
                lambda step, seconds: self._stepped(job, step, seconds),
                lambda error: self._ended(job, error),
                lambda: self._paused(job),
            )
            self._job, screen.edit_of = job, None
            screen.set(job=JobState(kind="search", stages=tuple(s.name for s in standing)))
        return self._job

    def _stepped(self, job: Job[SearchStep], step: SearchStep, seconds: float) -> None:
        screen = self._screen
        with screen.lock:
            if job is not self._job:
                return
            people = tuple(
                p if p.source is not None and np.array_equal(p.values, best) else Shown(best, "searched")
                for p, best in zip(screen.state.people, step.best, strict=True)
            )
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
            if job is not self._job:
                return
            if error is None:
                message = f"done: {screen.state.job.evaluations} poses scored"
            else:
                message = str(error) if isinstance(error, TrackerError) else f"the search failed: {error}"
            ended = replace(screen.state.job, running=False, kind=None, stage=None, candidate=None, message=message)
            screen.set(job=ended, **screen.costs(screen.state.poses))
            self._save(job)

    def _save(self, job: Job[SearchStep]) -> None:
        if any(p.source == "searched" for p in self._screen.state.people):
            self._screen.save("search", "searched", job)
