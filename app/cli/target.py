"""The session, people and frames that a command works on."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tracker.errors import SessionError, TrackerError

if TYPE_CHECKING:
    from tracker.session.session import Session


class Target(NamedTuple):
    """A session and the people of it that a command works on."""

    session: "Session"
    people: tuple[int, ...]
    """Indices into the session's people."""


def load_target(folder: Path, person: str | None, several: bool) -> Target:
    """Load a session and find the person that a command names.

    Args:
        folder: the session folder.
        person: name; optional in a session of one person, or if `several`.
        several: whether no name means all people.

    Raises:
        SessionError: there is no such person, or a name is needed.
    """
    from tracker.session.session import load_session
    from tracker.validation import nfc_name

    session = load_session(folder)
    names = [p.name for p in session.people]
    if person is None:
        if several or len(names) == 1:
            return Target(session, tuple(range(len(names))))
        raise SessionError(f"the session has several people: say --person, one of {', '.join(names)}")
    compared = [nfc_name(name) for name in names]
    if nfc_name(person) not in compared:
        raise SessionError(f"expected --person to be one of {', '.join(names)}, found '{person}'")
    return Target(session, (compared.index(nfc_name(person)),))


def parse_frames(text: str | None, session: "Session") -> range:
    """Parse `A:B`, half open, with either end optional; None gives all frames of the session.

    Raises:
        TrackerError: it is not a range within the session.
    """
    if text is None:
        return range(session.n_frames)
    first, colon, last = text.partition(":")
    try:
        found = range(int(first or 0), int(last or session.n_frames))
    except ValueError:
        found = range(0)
    if not colon or not found or found.start < 0 or found.stop > session.n_frames:
        raise TrackerError(f"expected --frames as A:B within 0:{session.n_frames} (A included, B not), found '{text}'")
    return found


def check_stride(stride: int) -> int:
    """Return a stride.

    Raises:
        TrackerError: it is below 1.
    """
    if stride < 1:
        raise TrackerError(f"expected --stride as a whole number from 1, found {stride}; 2 takes every second frame")
    return stride
