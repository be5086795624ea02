"""Check that the footage of two cameras is not exchanged, for commands and the page."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from tracker.evidence.camera_exchange import CameraExchange
    from tracker.footage.camera_source import CameraSource
    from tracker.footage.recording import Recording
    from tracker.geometry.arrays import Array
    from tracker.session.session import Session

T = TypeVar("T")


def exchange_note(session: "Session") -> str | None:
    """Return a sentence about two cameras whose footage seems to be exchanged; None if all seems right.

    Footage that cannot be read is not checked: what needs it says so.
    """
    found = exchange_of(session.cameras)
    return None if found is None else found.text


def exchange_of(cameras: "Sequence[CameraSource]") -> "CameraExchange | None":
    """Return two cameras whose footage seems to be exchanged; None if all seems right, or footage cannot be read."""
    from tracker.evidence.camera_exchange import find_exchange

    return _looked_at(cameras, lambda recording: find_exchange(cameras, recording))


def body_exchange_note(session: "Session", frame: int, points_world: "Array") -> str | None:
    """Return a sentence about two cameras that see a body, (N, 3), metres, only if exchanged; else None."""
    from tracker.evidence.camera_exchange import find_body_exchange

    found = _looked_at(
        session.cameras, lambda recording: find_body_exchange(session.cameras, recording, frame, points_world)
    )
    if found is None:
        return None
    a, b = found
    return (
        f"the footage of '{a}' and '{b}' seems to be exchanged: nothing differs from the background where the body is, "
        "and it does with the two exchanged; check which file is of which camera"
    )


def _looked_at(cameras: "Sequence[CameraSource]", find: "Callable[[Recording], T | None]") -> T | None:
    """Return what a function finds in the footage of cameras; None also where that cannot be read."""
    from app.session.footage_indices import footage_indices
    from tracker.errors import RecordingError
    from tracker.footage.recording import Recording

    try:
        with Recording(cameras, indices=footage_indices()) as recording:
            return find(recording)
    except RecordingError:
        return None
