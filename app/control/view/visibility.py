"""Control which people the views show, hide or dim. Poses and history are unaffected."""

from dataclasses import replace

from app.control.session.session_state import SessionState


class PeopleVisibility:
    """The visibility of the people."""

    def __init__(self, session_state: SessionState) -> None:
        """Control the views of this session."""
        self._session_state = session_state

    def show(self, person: int, shown: bool) -> None:
        """Show or hide a person, by index, in all views."""
        with self._session_state.lock:
            visibility = self._session_state.state.visibility
            hidden = visibility.hidden - {person} if shown else visibility.hidden | {person}
            self._session_state.set(visibility=replace(visibility, hidden=hidden))

    def solo(self, solo: bool) -> None:
        """Dim all people but the selected one, or show all normally."""
        with self._session_state.lock:
            self._session_state.set(visibility=replace(self._session_state.state.visibility, solo=solo))
