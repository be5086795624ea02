"""Whom the views show: who is hidden, and whether the others are dimmed. Poses and history know nothing of it."""

from dataclasses import replace

from app.control.session.session_state import SessionState


class PeopleVisibility:
    """The people on the screen."""

    def __init__(self, session_state: SessionState) -> None:
        """Choose among those who are on this screen."""
        self._session_state = session_state

    def show(self, person: int, shown: bool) -> None:
        """Show a person, by index, in all views, or nowhere."""
        with self._session_state.lock:
            visibility = self._session_state.state.visibility
            hidden = visibility.hidden - {person} if shown else visibility.hidden | {person}
            self._session_state.set(visibility=replace(visibility, hidden=hidden))

    def solo(self, solo: bool) -> None:
        """Dim everybody but the person worked on, or no more."""
        with self._session_state.lock:
            self._session_state.set(visibility=replace(self._session_state.state.visibility, solo=solo))
