"""Hold points of a body in place while others are dragged, or release them. No pose changes."""

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.state.people import HeldPoint
from tracker.body.limbs import display_name
from tracker.errors import TrackerError
from tracker.estimation.posing.grab import holdable_points


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
