"""Work in the background that a user starts, watches and stops."""

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from app.control.session.session_state import SessionState
from app.remedies import page_sentence
from app.runtime.jobs import StoppedError
from app.state.progress import WorkState
from tracker.errors import TrackerError

_LOG = logging.getLogger(__name__)
_STEPS = 100
"""Progress is shown in so many steps."""


class BackgroundWork:
    """Work in a thread of its own, at most one at a time. A part of the state shows how far it is, and how it ended."""

    def __init__(
        self, session_state: SessionState, part: str, name: str, stopped: str = "Stopped; nothing was changed."
    ) -> None:
        """Do nothing yet.

        Args:
            session_state: holds the state.
            part: name of the field of the state, a `WorkState`.
            name: what the work is, as text for the user.
            stopped: how one ends that was stopped, as a sentence.
        """
        self._session_state, self._part, self._name, self._stopped = session_state, part, name, stopped
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    @property
    def state(self) -> Any:
        """The part of the state."""
        return getattr(self._session_state.state, self._part)

    def require_free(self) -> None:
        """Refuse further work.

        Raises:
            TrackerError: some is under way.
        """
        if self.state.running:
            raise TrackerError(f"expected no other {self._name} under way, found one; stop it or wait for its end")

    def start(self, run: Callable[[], Mapping[str, Any]], begin: WorkState) -> None:
        """Begin work.

        Args:
            run: does it, and returns the changes of the part at its end. `report` ends it by an exception.
            begin: the part at the beginning.

        Raises:
            TrackerError: other work is under way.
        """
        with self._session_state.lock:
            self.require_free()
            self._show(replace(begin, running=True, stage="starting"))
            self._stopping.clear()
        self._thread = threading.Thread(target=self._work, args=(run,), name=self._name, daemon=True)
        self._thread.start()

    def stop(self, before_waiting: Callable[[], None] = lambda: None) -> None:
        """Stop the work, and wait for its end. The caller must not hold the lock.

        Args:
            before_waiting: stops what the work itself waits for.
        """
        self._stopping.set()
        if self.state.running:
            before_waiting()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(30)

    def set(self, **changes: Any) -> None:
        """Change values of the part."""
        with self._session_state.lock:
            self._show(replace(self.state, **changes))

    def _show(self, part: Any) -> None:
        self._session_state.set(**{self._part: part})

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """Show progress.

        Raises:
            StoppedError: the work is to end.
        """
        if self._stopping.is_set():
            raise StoppedError
        before, share = self.state, round(share * _STEPS) / _STEPS
        if (stage, share) != (before.stage, before.share):
            self.set(stage=stage, share=share)

    def _work(self, run: Callable[[], Mapping[str, Any]]) -> None:
        try:
            ended = run()
        except StoppedError:
            ended = {"message": self._stopped}
        except Exception as error:
            ended = failure(error)
        self.set(**{"running": False, **ended})


def failure(error: Exception) -> dict[str, Any]:
    """Return how work ends that an error has ended. The log has those that no user can mend."""
    if not isinstance(error, TrackerError):
        _LOG.error("work failed", exc_info=error)
    return {"message": page_sentence(error), "failed": True}
