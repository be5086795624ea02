"""Note which view would show the depth of a point that was placed in opposite or neighbouring views alone."""

from contextlib import suppress

from app.control.session.session_state import SessionState
from app.state.people import DepthNote
from tracker.errors import SessionError
from tracker.estimation.posing.placed_depth import undetermined_depth
from tracker.pipeline.marked_points import user_marked_points

_MIN_MARKS = 2
"""Placements of a person on a frame before depth is missed: after a single one, the user may go on to any view."""


def note_unseen_depth(session_state: SessionState, person: int, point: str) -> None:
    """Note that no view has shown the depth of a point that was just placed, or no longer; called under the lock.

    Args:
        session_state: holds the state, with the placement saved.
        person: index of the person.
        point: name of the point.
    """
    state, model = session_state.state, session_state.models[person]
    marks = list(state.pins[person])
    with suppress(SessionError):
        record = session_state.saver.record(person, state.frame)
        if record is not None:
            marks += user_marked_points(session_state.session.cameras, model, record)
    names, views = {at.point for at in marks}, [c.camera for c in session_state.session.cameras]
    found = None
    if point in names and len(marks) >= _MIN_MARKS:
        points_world = model.points_world(state.poses[person])
        places = {name: points_world[model.point_names.index(name)] for name in sorted(names)}
        seen_by = {name: [at.camera for at in marks if at.point == name] for name in names}
        found = undetermined_depth(places, seen_by, views, point)
    note = None if found is None else DepthNote(state.frame, person, state.poses[person], found)
    if note is not None or state.depth_note is not None:
        session_state.set(depth_note=note)
