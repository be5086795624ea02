"""Let one activity at a time change poses: jobs are halted and gestures finished before an edit."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Protocol

from app.storage.edit_claims import EditClaimError, EditClaims


class BackgroundJob(Protocol):
    """Work in another thread that changes poses: a search, a tracking run, work on a range of frames."""

    @property
    def running(self) -> bool:
        """Whether the job is at work."""

    def halt(self) -> None:
        """Halt the job after its current step. The caller must not hold the lock, because the step takes it."""

    def forget(self) -> None:
        """Discard a halted job; its results so far stay."""

    def stop(self) -> None:
        """Halt the job at the user's request. The caller must not hold the lock."""


class Activities:
    """The jobs and gestures of one session. At most one of them changes poses at a time."""

    def __init__(
        self, lock: threading.RLock, restore: Callable[[], None] = lambda: None, turns: EditClaims | None = None,
        owner: object = None,
    ) -> None:  # fmt: skip
        """Register nothing yet.

        Args:
            lock: of the session's state.
            restore: shows the stored poses again, after an edit that another person's work refuses.
            turns: those who work on the session.
            owner: stands for the one whose activities these are.
        """
        self._lock, self._restore, self._turns, self._owner = lock, restore, turns or EditClaims(), owner
        self._jobs: list[BackgroundJob] = []
        self._on_shown_frame: list[BackgroundJob] = []
        self._finish_gestures: list[Callable[[], None]] = []

    def add_job(self, job: BackgroundJob, on_shown_frame: bool) -> None:
        """Register a job.

        Args:
            job: halted and discarded before each edit.
            on_shown_frame: whether the job shows its poses as it finds them. Jobs that do exclude each other.
        """
        self._jobs.append(job)
        if on_shown_frame:
            self._on_shown_frame.append(job)

    def add_gesture(self, finish: Callable[[], None]) -> None:
        """Register a kind of gesture by the function that ends and saves it; called under the lock."""
        self._finish_gestures.append(finish)

    @contextmanager
    def editing(self, alone: bool = False) -> Generator[None, None, None]:
        """Hold the lock for an edit, with all jobs discarded and all gestures finished.

        Args:
            alone: whether nobody else may be at work, because bodies or cameras change.

        Raises:
            TurnError: another person works on what the edit changes; the stored poses are shown again.
        """
        while True:
            for job in self._jobs:  # without the lock: the last step of a job takes it
                job.halt()
            with self._lock:
                if any(job.running for job in self._jobs):
                    continue  # another thread has started one
                self.finish_gestures()
                for job in self._jobs:
                    job.forget()
                if alone:
                    self._turns.require_alone(self._owner)
                try:
                    yield
                except EditClaimError:
                    self._restore()
                    raise
                return

    @contextmanager
    def starting(self, job: BackgroundJob) -> Generator[None, None, None]:
        """Hold the lock to start or resume a job, with its rivals discarded and all gestures finished."""
        rivals = [other for other in self._on_shown_frame if other is not job]
        for rival in rivals:
            rival.halt()
        with self._lock:
            self.finish_gestures()
            for rival in rivals:
                rival.forget()
            yield

    def finish_gestures(self) -> None:
        """End and save the current gesture, of any kind; called under the lock."""
        for finish in self._finish_gestures:
            finish()

    def stop(self) -> None:
        """Stop all jobs with their best results on disk. A search is only paused, a tracking run is over."""
        for job in self._jobs:
            job.stop()
