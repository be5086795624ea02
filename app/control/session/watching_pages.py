"""Pages that look at something that is computed for them alone."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from app.control.session.session_state import SessionState
from app.state.state import State

T = TypeVar("T")


class WatchingPages(Generic[T]):
    """The pages that look, by number, with the wish of each. While there are some, a view follows the state."""

    def __init__(self, session_state: SessionState, changed: Callable[[State], None]) -> None:
        """Begin without pages.

        Args:
            session_state: holds the state.
            changed: is called with each new state while a page looks.
        """
        self._session_state, self._changed = session_state, changed
        self._unsubscribe: Callable[[], None] | None = None
        self._wishes: dict[int, T] = {}
        self._lock = threading.Lock()

    def __contains__(self, page: int) -> bool:
        return page in self._wishes

    def __bool__(self) -> bool:
        return bool(self._wishes)

    @property
    def newest(self) -> T | None:
        """The wish of the page that came last; None without pages."""
        with self._lock:
            return next(reversed(self._wishes.values()), None)

    def enter(self, page: int, wish: T) -> None:
        """Note the wish of a page, in place of its former one."""
        with self._lock:
            self._wishes.pop(page, None)
            self._wishes[page] = wish
            if self._unsubscribe is None:
                self._unsubscribe = self._session_state.subscribe(self._changed)

    def leave(self, page: int) -> None:
        """Note that a page looks no more."""
        with self._lock:
            self._wishes.pop(page, None)
            if not self._wishes and self._unsubscribe is not None:
                self._unsubscribe()
                self._unsubscribe = None
