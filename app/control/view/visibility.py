"""Whom the views show: who is hidden, and whether the others are dimmed. Poses and history know nothing of it."""

from dataclasses import replace

from app.control.session.session_state import Screen


class Casting:
    """The people on the screen."""

    def __init__(self, screen: Screen) -> None:
        """Choose among those who are on this screen."""
        self._screen = screen

    def show(self, person: int, shown: bool) -> None:
        """Show a person, by index, in all views, or nowhere."""
        with self._screen.lock:
            cast = self._screen.state.cast
            hidden = cast.hidden - {person} if shown else cast.hidden | {person}
            self._screen.set(cast=replace(cast, hidden=hidden))

    def solo(self, solo: bool) -> None:
        """Dim everybody but the person worked on, or no more."""
        with self._screen.lock:
            self._screen.set(cast=replace(self._screen.state.cast, solo=solo))
