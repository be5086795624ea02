"""Check that the footage of two cameras is not exchanged, for the commands that report it."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tracker.geometry.arrays import Array
    from tracker.session.session import Session


def exchange_note(session: "Session") -> str | None:
    """Return a sentence about two cameras whose footage seems to be exchanged; None if all seems right.

    Footage that cannot be read is not checked: what needs it says so.
    """
    from app.session.footage_indices import footage_indices
    from tracker.errors import RecordingError
    from tracker.evidence.camera_exchange import find_exchange
    from tracker.footage.recording import Recording

    try:
        with Recording(session.cameras, indices=footage_indices()) as recording:
            found = find_exchange(session.cameras, recording)
    except RecordingError:
        return None
    return None if found is None else found.text


def body_exchange_note(session: "Session", frame: int, points_world: "Array") -> str | None:
    """Return a sentence about two cameras that see a body, (N, 3), metres, only if exchanged; else None."""
    from app.session.footage_indices import footage_indices
    from tracker.errors import RecordingError
    from tracker.evidence.camera_exchange import find_body_exchange
    from tracker.footage.recording import Recording

    try:
        with Recording(session.cameras, indices=footage_indices()) as recording:
            found = find_body_exchange(session.cameras, recording, frame, points_world)
    except RecordingError:
        return None
    if found is None:
        return None
    a, b = found
    return (
        f"the footage of '{a}' and '{b}' seems to be exchanged: nothing differs from the background where the body is, "
        "and it does with the two exchanged; check which file is of which camera"
    )
