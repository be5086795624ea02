"""Choose what the 3-D view shows and through which camera it looks; stored with the session."""

from dataclasses import replace
from typing import Any

from app.control.session.session_state import SessionState
from app.state.view_3d import restored, stored

_KEY = "view_3d"
"""Setting of the session."""


class View3dSettings:
    """The settings of the 3-D view."""

    def __init__(self, session_state: SessionState) -> None:
        """Restore the settings of the session."""
        self._session_state = session_state
        session_state.set(view_3d=restored(session_state.saver.setting(_KEY)))

    def choose(self, **changes: Any) -> None:
        """Change fields of `View3d`; on disk when this returns.

        Raises:
            TrackerError: the session's settings cannot be written; the view changes nevertheless.
        """
        with self._session_state.lock:
            view = replace(self._session_state.state.view_3d, **changes)
            if view == self._session_state.state.view_3d:
                return
            self._session_state.set(view_3d=view)
            self._session_state.saver.store_setting(_KEY, stored(view))

    def note_prediction(self, note: str) -> None:
        """Say what the predicted pose was computed from, or why there is none; empty if it is not shown."""
        if note != self._session_state.state.prediction_note:
            self._session_state.set(prediction_note=note)

    def pause(self, page: int, paused: bool) -> None:
        """Pause the 3-D view during drags, or no longer, for a page that renders in software.

        Args:
            page: number of the page.
            paused: whether the page wants the pause.
        """
        with self._session_state.lock:
            others = self._session_state.state.pages_pausing_3d - {page}
            self._session_state.set(pages_pausing_3d=others | {page} if paused else others)

    def blur_faces(self, page: int, is_blurred: bool) -> None:
        """Blur faces in pictures of the 3-D view while a page does so in its views, given by its number."""
        with self._session_state.lock:
            others = self._session_state.state.pages_blurring_faces - {page}
            pages = others | {page} if is_blurred else others
            if pages != self._session_state.state.pages_blurring_faces:
                self._session_state.set(pages_blurring_faces=pages)

    def look_through_camera(self, camera: int | None) -> None:
        """Look through a camera, by index, with its image behind the bodies; None frees the view."""
        if camera is None or 0 <= camera < len(self._session_state.session.cameras):
            self._session_state.set(snapped=camera)
