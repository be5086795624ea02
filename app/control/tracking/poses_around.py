"""The pose of a person, and those of all people on the frames around it."""

from collections.abc import Sequence

from app.control.session.session_state import SessionState
from tracker.geometry.arrays import Array
from tracker.pipeline.pose_check import PoseInRun, frames_around


def pose_in_run(session_state: SessionState, person: int, frame: int, alternatives: Sequence[Array] = ()) -> PoseInRun:
    """Return the stored pose of a person with those of all people around, in the present bodies.

    Args:
        session_state: holds the session.
        person: index of the person.
        frame: frame of the pose.
        alternatives: stored alternatives of the pose, (n_values,) each.
    """
    saver, people = session_state.saver, range(len(session_state.session.people))
    with session_state.lock:
        posed = sorted(set.intersection(*(set(saver.index.frames(i)) for i in people)) | {frame})
        of_frames = {k: [saver.pose_now(i, k) for i in people] for k in frames_around(frame, posed)}
        active = session_state.active_dofs(person)
    known = {k: [p for p in poses if p is not None] for k, poses in of_frames.items()}
    return PoseInRun(frame, person, {k: p for k, p in known.items() if len(p) == len(people)}, alternatives, active)
