"""Choose the shown frame, the selected person and the selected point."""

from app.control.search.searching import SearchRunner
from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.control.tracking.tracking import Tracking


class Navigation:
    """Moves through the recording. No stored pose changes, but gestures and searches end."""

    def __init__(
        self, session_state: SessionState, activities: Activities, search: SearchRunner, tracking: Tracking
    ) -> None:
        """Navigate in this session.

        Args:
            session_state: holds the state.
            activities: finishes gestures.
            search: ends with the frame that it is about.
            tracking: continues when another frame is shown, but no longer shows its frames.
        """
        self._session_state, self._activities = session_state, activities
        self._search, self._tracking = search, tracking

    def seek(self, frame: int) -> None:
        """Show a frame. A gesture ends and a search is discarded; a running tracker continues and is not followed."""
        session_state = self._session_state
        frame = min(max(0, int(frame)), session_state.session.n_frames - 1)
        if frame == session_state.state.frame:
            return
        self._search.halt()
        with session_state.lock:
            self._activities.finish_gestures()
            self._search.forget()
            self._tracking.flush()
            state = session_state.state
            session_state.show_frame(frame=frame, follow=state.follow and not state.track.running)

    def select(self, person: int, point: str | None) -> None:
        """Select a person, and one of the body's points; an unknown person or point is ignored."""
        models = self._session_state.models
        if 0 <= person < len(models) and (point is None or point in models[person].point_names):
            self._session_state.set(person=person, point=point)
