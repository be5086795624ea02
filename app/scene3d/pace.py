"""When the 3-D view and its panels follow the state: at once, but where no graphics card draws them."""

import time

from app.control.controller import Controller
from app.state.state import State

_SELDOM_S = 2.0
"""Least time between two drawings while something is at work, or frames go by."""
_REST_S = 0.25
"""How long a frame has been shown before it is drawn: its pictures come first."""


class Pace:
    """Passes over states that would cost the browser more than they are worth: a newer one always follows."""

    def __init__(self, controller: Controller) -> None:
        """Nothing has been drawn yet."""
        self._controller = controller
        self._frame, self._drawn_at = controller.state.frame, float("-inf")

    def due(self, state: State) -> State | None:
        """What to draw now, which then counts as drawn: this state or one that has come since; None for nothing.

        Waits for a moment where the frame is another than was drawn.
        """
        frame = state.frame
        # Who looks through a camera sees the bodies on its image: they go together.
        if state.pages_pausing_3d and state.snapped is None and frame != self._frame:
            time.sleep(_REST_S)
            state = self._controller.state
        seldom = state.is_3d_throttled or state.frame != frame
        if state.is_3d_paused or (seldom and time.monotonic() < self._drawn_at + _SELDOM_S):
            return None
        self._frame, self._drawn_at = state.frame, time.monotonic()
        return state
