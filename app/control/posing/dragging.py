"""Pose people by dragging points and parts. A drag from press to release is one entry of the history.

Hold points of a body in place while others are dragged, or release them. No pose changes.
"""

import time
from dataclasses import replace

import numpy as np

from app.control.posing.depth_check import note_unseen_depth
from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.people import DragState, HeldPoint
from app.state.state import State
from tracker.body.limbs import display_name
from tracker.errors import TrackerError
from tracker.estimation.posing import drag as modes
from tracker.estimation.posing.grab import Grab, grab, grab_part, holdable_points, regrab
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation


class HeldPoints:
    """The points that drags leave in place. A drag holds the point that it placed."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Hold nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._activities = session_state, activities
        self._placed: dict[int, set[HeldPoint]] = {}  # by entry of the history, the points that its drag came to hold

    def place(self, placed: HeldPoint) -> None:
        """Hold a point that a drag has placed, as long as its entry of the history is not undone."""
        session_state, edit = self._session_state, self._session_state.edit
        if placed not in session_state.state.held and edit is not None:
            self._placed.setdefault(edit, set()).add(placed)
        session_state.set(held=session_state.state.held | {placed})

    def follow(self) -> None:
        """Release the points of drags that a move along the history reverted; hold those that it brought back."""
        moves = self._session_state.saver.moves
        placed = set[HeldPoint]().union(*(self._placed.get(edit, ()) for edit in moves.moved_edits))
        held = self._session_state.state.held
        self._session_state.set(held=held - placed if moves.is_undone else held | placed)

    def set(self, person: int, point: str | None, held: bool, frame: int | None = None) -> None:
        """Hold a point where it is, or release it.

        Args:
            person: index of the person.
            point: name of the point; None for all that can be held.
            held: whether to hold.
            frame: the frame that the user saw; None for the shown one.

        Raises:
            TrackerError: the point cannot be held.
        """
        with self._activities.editing():
            self._session_state.go_to(frame)
            known = holdable_points(self._session_state.models[person])
            if point is not None and point not in known:
                raise TrackerError(
                    f"expected a point that can be held ({', '.join(map(display_name, known))}), found "
                    f"{display_name(point)}; select one of those"
                )
            state, chosen = self._session_state.state, known if point is None else (point,)
            if held:
                chosen = tuple(set(chosen) - state.held_points(person))
                now = state.held | {HeldPoint(state.frame, person, name, None) for name in chosen}
            else:
                now = frozenset(
                    h for h in state.held if (h.frame, h.person) != (state.frame, person) or h.point not in chosen
                )
            self._session_state.set(held=now)


_CHECKPOINT_S = 1.0
"""A long drag is saved at least this often."""
_REST_S, _HEAD_START_S = 0.15, 0.02
"""Time between two scorings of a dragged pose, and the delay of each: poses must reach the page first."""

_MODES = {"move": modes.drag, "turn": modes.turn, "push": modes.push, "bend": modes.bend}


class Dragging:
    """Drags on the shown frame; at most one at a time."""

    def __init__(self, session_state: SessionState, activities: Activities, held_points: HeldPoints) -> None:
        """Drag nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
            held_points: hold a point where a drag has placed it.
        """
        self._session_state, self._activities, self._held_points = session_state, activities, held_points
        self._gesture_grab: Grab | None = None  # at the start of the gesture
        self._mode_grab: Grab | None = None  # at the start of its present mode
        self._page = 0
        self._scores_moves = False  # whether the dragged pose is still to be scored in the background
        activities.add_gesture(self.finish)
        self._costs = LatestWinsWorker(self._score, "cost of drag", _REST_S)

    def close(self) -> None:
        """End the thread."""
        self._costs.close()

    def begin(
        self,
        page: int,
        camera: int,
        person: int,
        point: str,
        pointer_px: tuple[float, float],
        frame: int | None = None,
        part: int | None = None,
    ) -> None:
        """Grab a point in a view, or the surface of a part.

        Args:
            page: number of the page.
            camera: index of the view.
            person: index of the person.
            point: name of the point; ignored if a part is given.
            pointer_px: undistorted px.
            frame: the frame that the user saw, which a tracker may have left; None for the shown one.
            part: index of the part whose surface is grabbed.

        Raises:
            TrackerError: all degrees of freedom that move it are locked.
            TurnError: somebody else works on the pose.
        """
        session_state = self._session_state
        cameras, models = session_state.session.cameras, session_state.models
        if not (0 <= camera < len(cameras) and 0 <= person < len(models)):
            return
        model = models[person]
        if part is None and point not in model.point_names:
            return
        if part is not None and not 0 <= part < len(model.parts):
            return
        with self._activities.editing():
            session_state.go_to(frame)
            session_state.require_editable([person])
            values = session_state.state.poses[person]
            view, pointer = cameras[camera].camera, np.array(pointer_px)
            constraints = session_state.drag_constraints(person)
            if part is None:
                grabbed = grab(model, values, view, point, pointer, constraints)
                selected, name = point, point
            else:
                grabbed = grab_part(model, values, view, part, pointer, constraints)
                selected, name = model.joints[part].name, model.parts[part].name
            self._gesture_grab = self._mode_grab = grabbed
            self._page, session_state.last_save = page, time.monotonic()
            x, y, z = (float(c) for c in grabbed.point_part)
            drag = DragState(camera, person, name, pointer_px, grabbed.part, (x, y, z), part is not None)
            session_state.set(person=person, point=selected, drag=drag)

    def move(
        self, page: int, pointer_px: tuple[float, float], seq: int, mode: str = "move", is_last: bool = False
    ) -> None:
        """Move the grabbed point to the pointer, turn its part, push it in depth, or bend the trunk as well (see
        `tracker.estimation.posing.drag`).

        A change of mode grabs the point again at the last pointer position, so that nothing jumps.

        Args:
            page: number of the page.
            pointer_px: undistorted px.
            seq: sequence number of the page's message.
            mode: `move`, `turn`, `push` or `bend`.
            is_last: whether the drag ends here. Its pose is not scored now, because `end` scores it.
        """
        session_state = self._session_state
        with session_state.lock:
            drag = session_state.state.drag
            if self._mode_grab is None or drag is None or page != self._page:
                return
            before = session_state.state.poses[drag.person]
            if mode != drag.mode:
                self._mode_grab = regrab(self._mode_grab, before, np.array(drag.pointer_px))
                drag = replace(drag, mode=mode)
            values = _MODES[mode](self._mode_grab, np.array(pointer_px), before)
            short_m, wanted_px = _shortfall(self._mode_grab, np.array(pointer_px), values, mode)
            seqs = (*(s for s in session_state.state.drag_seqs if s[0] != page), (page, seq))[-16:]
            people = session_state.people_with_pose(drag.person, values)
            session_state.set(
                people=people,
                drag=replace(drag, pointer_px=pointer_px, short_m=short_m, wanted_px=wanted_px),
                drag_seqs=seqs,
            )
            self._scores_moves = not is_last
            if not is_last:
                self._costs.offer(session_state.state)
            if self._gesture_grab is not None and time.monotonic() - session_state.last_save > _CHECKPOINT_S:
                self._save(replace(drag, pointer_px=pointer_px), self._gesture_grab)

    def end(self, page: int) -> None:
        """Release the point; the gesture is one entry of the history, on disk when this returns."""
        with self._session_state.lock:
            if page == self._page:
                self.finish()

    def cancel(self, page: int) -> None:
        """Release the point and restore the pose before the gesture."""
        with self._session_state.lock:
            grab, drag = self._gesture_grab, self._session_state.state.drag
            if grab is None or drag is None or page != self._page:
                return
            self._gesture_grab = self._mode_grab = None
            self._session_state.revert(grab)

    def finish(self) -> None:
        """End the drag, if there is one, and save it; called under the lock."""
        session_state, grab, drag = self._session_state, self._gesture_grab, self._session_state.state.drag
        if grab is None or drag is None:
            return
        self._scores_moves = False
        session_state.set(**vars(session_state.costs(session_state.state.poses)))
        has_moved = not np.array_equal(grab.pose, session_state.state.poses[drag.person])
        if has_moved or session_state.open_edit_owner is grab:
            self._save(drag, grab)
            self._hold(drag)
        elif not session_state.is_shown_stored(session_state.state):
            session_state.show_frame()  # moved back: the pose has its former source
        self._gesture_grab = self._mode_grab = session_state.open_edit_owner = None
        session_state.set(drag=None)
        if has_moved:
            note_unseen_depth(session_state, drag.person, drag.point)

    def _save(self, drag: DragState, grab: Grab) -> None:
        """Save the dragged pose, and where the user put the point."""
        session_state = self._session_state
        people = list(session_state.state.people)
        people[drag.person] = replace(people[drag.person], seen=self._seen(drag))
        session_state.set(people=tuple(people))
        session_state.save(f"drag {display_name(drag.point)}", "manual", grab, drag.person)

    def _seen(self, drag: DragState) -> tuple[PointObservation, ...]:
        """Return where the user has put the dragged point: the body may not reach it."""
        if drag.by_surface or drag.mode not in ("move", "bend") or self._mode_grab is None:
            return ()
        u, v = (float(c) for c in np.array(drag.pointer_px) + self._mode_grab.offset_px)
        return (PointObservation(drag.point, drag.camera, (u, v)),)

    def _hold(self, drag: DragState) -> None:
        """Hold the point that was placed in a view."""
        state = self._session_state.state
        if not drag.by_surface and drag.point in holdable_points(self._session_state.models[drag.person]):
            self._held_points.place(HeldPoint(state.frame, drag.person, drag.point, drag.camera))

    def _score(self, _: State) -> None:
        """Score the dragged pose, unless it has changed meanwhile or the drag is over."""
        time.sleep(_HEAD_START_S)
        session_state = self._session_state
        with session_state.lock:
            scored = session_state.state
            if scored.drag is None or not self._scores_moves:
                return
        costs = session_state.costs(scored.poses)
        with session_state.lock:
            if session_state.state.drag is not None and session_state.state.people is scored.people:
                session_state.set(**vars(costs))


def _shortfall(grabbed: Grab, pointer_px: Array, values: Array, mode: str) -> tuple[float, tuple[float, float] | None]:
    """Return by how many metres a grabbed point stays behind the pointer, and where it should be, px.

    A body that turns about the vertical, or about a line of sight, is not meant to be under the pointer.
    """
    if mode not in ("move", "bend") or (grabbed.role == "heading" and mode == "move"):
        return 0.0, None
    u, v = (float(c) for c in pointer_px + grabbed.offset_px)
    return grabbed.miss_m(pointer_px, values), (u, v)
