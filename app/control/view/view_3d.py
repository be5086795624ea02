"""What the 3-D view shows, and through which camera it looks; kept with the session."""

from dataclasses import replace
from typing import Any

from app.control.session.session_state import Screen
from app.state.view_3d import View3d, kept, restored

_KEY = "view_3d"
"""Setting of the session."""


class Viewing:
    """The choices of whoever looks at the 3-D view."""

    def __init__(self, screen: Screen) -> None:
        """Take over what is kept with the session."""
        self._screen = screen
        # Two bodies close together are told apart by their own colours, not by those of their parts.
        usual = View3d(colors="people" if len(screen.session.people) > 1 else "parts")
        screen.set(view_3d=restored(screen.saver.setting(_KEY), usual))

    def choose(self, **changes: Any) -> None:
        """Change fields of `View3d`; on disk when this returns.

        Raises:
            TrackerError: the session's settings cannot be written; the view is changed all the same.
        """
        with self._screen.lock:
            view = replace(self._screen.state.view_3d, **changes)
            if view == self._screen.state.view_3d:
                return
            self._screen.set(view_3d=view)
            self._screen.saver.keep_setting(_KEY, kept(view))

    def snap(self, camera: int | None) -> None:
        """Look through a camera, by index, with its image behind the bodies; None lets the view go."""
        if camera is None or 0 <= camera < len(self._screen.session.cameras):
            self._screen.set(snapped=camera)
