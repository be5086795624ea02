"""Posing by hand: a drag from press to release is one entry of the history."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from app.control.session.session_state import Screen
from app.runtime.jobs import Latest
from app.state.state import DragState, State
from tracker.body.limbs import display_name
from tracker.posing import drag as posing

_CHECKPOINT_S = 1.0
"""A long drag is on disk at least this often."""
_REST_S, _HEAD_START_S = 0.15, 0.02
"""Time between two costs of what a hand moves, and how far a pose is ahead of its own: a hand waits for poses alone."""


class Hand:
    """The hand of whoever works on the screen; at most one drag at a time."""

    def __init__(self, screen: Screen, editing: Callable[[], AbstractContextManager[None]]) -> None:
        """Pose who is on this screen.

        Args:
            screen: holds the state.
            editing: gives the lock with nothing at work and no gesture at hand (`Controller.editing`).
        """
        self._screen, self._editing = screen, editing
        self._grab: posing.Grab | None = None  # as the gesture began
        self._hold: posing.Grab | None = None  # as its present mode began
        self._grab_page = 0
        self._scores_moves = False  # whether the pose in hand is still to be scored in the background
        self._costs = Latest(self._cost, "cost in hand", _REST_S)

    def close(self) -> None:
        """End the thread."""
        self._costs.close()

    def begin_drag(
        self,
        page: int,
        camera: int,
        person: int,
        point: str,
        pointer_px: tuple[float, float],
        frame: int | None = None,
        part: int | None = None,
    ) -> None:
        """Take hold of a point in a view, or of a part by its surface.

        Args:
            page: number of the page.
            camera: index of the view.
            person: index of whom.
            point: name of the point; of no account where a part is given.
            pointer_px: undistorted px.
            frame: the frame that the user saw, which a tracker may have left meanwhile; None for the one shown.
            part: index of the part that is held by its surface.

        Raises:
            TrackerError: whatever moves it is locked.
        """
        if not (0 <= camera < len(self._screen.session.cameras) and 0 <= person < len(self._screen.models)):
            return
        model = self._screen.models[person]
        if part is None and point not in model.point_names:
            return
        if part is not None and not 0 <= part < len(model.parts):
            return
        with self._editing():
            self._screen.go_to(frame)
            values = self._screen.state.poses[person]
            view, pointer = self._screen.session.cameras[camera].camera, np.array(pointer_px)
            free = self._screen.free(person)
            if part is None:
                self._grab = posing.grab(model, values, view, point, pointer, free)
                selected, name = point, point
            else:
                self._grab = posing.grab_part(model, values, view, part, pointer, free)
                selected, name = model.joints[part].name, model.parts[part].name
            self._hold = self._grab
            self._grab_page, self._screen.last_save = page, time.monotonic()
            x, y, z = (float(c) for c in self._grab.place_part)
            drag = DragState(camera, person, name, pointer_px, self._grab.part, (x, y, z), part is not None)
            self._screen.set(person=person, point=selected, drag=drag)

    def move_drag(
        self, page: int, pointer_px: tuple[float, float], seq: int, mode: str = "move", is_last: bool = False
    ) -> None:
        """Let the held point follow the pointer; or turn its part, or push it in depth (see `tracker.posing.drag`).

        Whenever the mode changes the hand takes hold anew, where the pointer was: nothing jumps. The last move of a
        drag is not scored here, because `end_drag` scores its pose.
        """
        ways = {"move": posing.drag, "turn": posing.turn, "push": posing.push}
        with self._screen.lock:
            drag = self._screen.state.drag
            if self._hold is None or drag is None or page != self._grab_page:
                return
            before = self._screen.state.poses[drag.person]
            if mode != drag.mode:
                self._hold = posing.regrab(self._hold, before, np.array(drag.pointer_px))
                drag = replace(drag, mode=mode)
            values = ways[mode](self._hold, np.array(pointer_px), before)
            seqs = (*(s for s in self._screen.state.drag_seqs if s[0] != page), (page, seq))[-16:]
            people = self._screen.posed(drag.person, values)
            self._screen.set(people=people, drag=replace(drag, pointer_px=pointer_px), drag_seqs=seqs)
            self._scores_moves = not is_last
            if not is_last:
                self._costs.offer(self._screen.state)
            if time.monotonic() - self._screen.last_save > _CHECKPOINT_S:
                self._screen.save(f"drag {display_name(drag.point)}", "manual", self._grab)

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
            self._grab = self._hold = None
            self._screen.take_back(hand)

    def finish(self) -> None:
        """End the drag at hand, if there is one, and save it."""
        hand, drag = self._grab, self._screen.state.drag
        if hand is None or drag is None:
            return
        self._scores_moves = False
        if not np.array_equal(hand.values, self._screen.state.poses[drag.person]) or self._screen.edit_of is hand:
            self._screen.save(f"drag {display_name(drag.point)}", "manual", hand)
        self._grab = self._hold = self._screen.edit_of = None
        self._screen.set(drag=None, **self._screen.costs(self._screen.state.poses))

    def _cost(self, _: State) -> None:
        """Work out what the pose in hand costs, unless it has changed by then, or been let go: others know its cost."""
        time.sleep(_HEAD_START_S)
        state = self._screen.state
        costs = self._screen.costs(state.poses) if self._scores_moves and state.drag is not None else {}
        with self._screen.lock:
            if costs and self._screen.state.drag is not None and self._screen.state.people is state.people:
                self._screen.set(**costs)
