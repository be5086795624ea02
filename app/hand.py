"""Posing by hand: a drag from press to release is one entry of the history."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from app.screen import Screen, spoken
from app.state import DragState
from tracker import posing

_CHECKPOINT_S = 1.0
"""A long drag is on disk at least this often."""


class Hand:
    """The hand of whoever works on the screen; at most one drag at a time."""

    def __init__(self, screen: Screen, editing: Callable[[], AbstractContextManager[None]]) -> None:
        """Pose who is on this screen.

        Args:
            screen: holds the state.
            editing: gives the lock with nothing at work and no gesture at hand (`Controller.editing`).
        """
        self._screen, self._editing = screen, editing
        self._grab: posing.Grab | None = None
        self._grab_page = 0

    def begin_drag(
        self, page: int, camera: int, person: int, point: str, pointer_px: tuple[float, float], frame: int | None = None
    ) -> None:
        """Take hold of a point in a view; pointer in undistorted px.

        The hand means the frame that it saw, which a tracker may have left meanwhile; None for the one shown.
        """
        if not (0 <= camera < len(self._screen.session.cameras) and 0 <= person < len(self._screen.models)):
            return
        if point not in self._screen.models[person].point_names:
            return
        with self._editing():
            if frame is not None and frame != self._screen.state.frame and 0 <= frame < self._screen.session.n_frames:
                self._screen.show(frame)
            values = self._screen.state.poses[person]
            view = self._screen.session.cameras[camera].camera
            self._grab = posing.grab(
                self._screen.models[person], values, view, point, np.array(pointer_px), self._screen.free(person)
            )
            self._grab_page, self._screen.last_save = page, time.monotonic()
            self._screen.set(person=person, point=point, drag=DragState(camera, person, point, pointer_px))

    def move_drag(self, page: int, pointer_px: tuple[float, float], seq: int) -> None:
        """Let the held point follow the pointer."""
        with self._screen.lock:
            drag = self._screen.state.drag
            if self._grab is None or drag is None or page != self._grab_page:
                return
            values = posing.drag(self._grab, np.array(pointer_px), self._screen.state.poses[drag.person])
            seqs = (*(s for s in self._screen.state.drag_seqs if s[0] != page), (page, seq))[-16:]
            self._screen.pose(drag.person, values, drag=replace(drag, pointer_px=pointer_px), drag_seqs=seqs)
            if time.monotonic() - self._screen.last_save > _CHECKPOINT_S:
                self._screen.save(f"drag {spoken(drag.point)}", "manual", self._grab)

    def end_drag(self, page: int) -> None:
        """Let go: the gesture is one entry of the history, on disk when this returns."""
        with self._screen.lock:
            if page == self._grab_page:
                self.finish()

    def cancel_drag(self, page: int) -> None:
        """Let go and put the body back where it was."""
        with self._screen.lock:
            hand, drag = self._grab, self._screen.state.drag
            if hand is None or drag is None or page != self._grab_page:
                return
            checkpointed = self._screen.edit_of is hand
            self._grab = self._screen.edit_of = None
            if checkpointed:
                self._screen.saver.undo()
                self._screen.refresh_saving()
            self._screen.show(self._screen.state.frame)

    def finish(self) -> None:
        """End the drag at hand, if there is one, and save it."""
        hand, drag = self._grab, self._screen.state.drag
        if hand is None or drag is None:
            return
        if not np.array_equal(hand.values, self._screen.state.poses[drag.person]) or self._screen.edit_of is hand:
            self._screen.save(f"drag {spoken(drag.point)}", "manual", hand)
        self._grab = self._screen.edit_of = None
        self._screen.set(drag=None)
