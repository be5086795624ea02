"""Throttle updates of the 3-D view when a browser renders in software."""

import time

from app.control.controller import Controller
from app.state.state import State

_LIMITED_S = 2.0
"""Least time between two updates during a search, a tracking run or a playback."""
_DELAY_S = 0.25
"""Time from the change of frame to the update: the pictures of the frame go first."""


class Throttle:
    """Drops states that are not worth the browser's time; a newer state always follows."""

    def __init__(self, controller: Controller) -> None:
        """Begin with nothing drawn."""
        self._controller = controller
        self._frame, self._drawn_at = controller.state.frame, float("-inf")

    def due(self, state: State) -> State | None:
        """Return the state to draw now, which then counts as drawn; None for nothing.

        Waits a moment if the frame changed, and returns the newest state then.
        """
        frame = state.frame
        # Through a camera, bodies and image are drawn together.
        if state.pages_pausing_3d and state.snapped is None and frame != self._frame:
            time.sleep(_DELAY_S)
            state = self._controller.state
        is_limited = state.is_3d_throttled or state.frame != frame
        if state.is_3d_paused or (is_limited and time.monotonic() < self._drawn_at + _LIMITED_S):
            return None
        self._frame, self._drawn_at = state.frame, time.monotonic()
        return state
