"""Remember the sessions that the user has opened, and the batches that were run, in the user's state folder."""

from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from tracker.errors import SessionError, TrackerError
from tracker.files import write_text_atomic
from tracker.formats.text_files import TextKind, read_json
from tracker.session.folder import SESSION_FILE
from tracker.validation import check

_FILE, _BATCHES_FILE = "recent_sessions.json", "recent_batches.json"
TABLE_FILE = "table.json"
"""Name of the file in the folder of a batch that holds its last table."""
_KIND = TextKind("list of recent sessions", 200_000, SessionError)
_MAX = 20


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    folder: Annotated[str, Meta(max_length=4096)]
    opened: Annotated[str, Meta(max_length=40)]


class RecentSession(NamedTuple):
    """A session that was opened and still exists."""

    folder: Path
    opened: str
    """Time of the last opening, ISO 8601, UTC."""


def recent_sessions(state_folder: Path) -> list[RecentSession]:
    """Return the sessions that still exist, the last one opened first; empty if the list is missing or damaged."""
    listed = (RecentSession(Path(entry.folder), entry.opened) for entry in _read(state_folder))
    return [session for session in listed if is_session(session.folder)]


def recent_batches(state_folder: Path) -> list[Path]:
    """Return the folders of batches that still exist, the last one first."""
    folders = (Path(entry.folder) for entry in _read(state_folder, _BATCHES_FILE))
    return [folder for folder in folders if (folder / TABLE_FILE).is_file()]


def remember(state_folder: Path, folder: Path) -> None:
    """Put a session first. If the state folder cannot be written, nothing is remembered.

    Args:
        state_folder: private to this user; made where it is missing.
        folder: of the session.
    """
    _remember(state_folder, folder, _FILE)


def remember_batch(state_folder: Path, folder: Path) -> None:
    """Put a batch first; see `remember`."""
    _remember(state_folder, folder, _BATCHES_FILE)


def _remember(state_folder: Path, folder: Path, file: str) -> None:
    path = str(folder.resolve())
    others = [entry for entry in _read(state_folder, file) if entry.folder != path]
    entries = [_Entry(path, datetime.now(UTC).isoformat(timespec="seconds")), *others][:_MAX]
    # A path that is no Unicode cannot be written as JSON.
    with suppress(OSError, TrackerError, UnicodeError):
        state_folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_text_atomic(state_folder / file, msgspec.json.encode(entries).decode(), mode=0o600)


def is_session(folder: Path) -> bool:
    """Return whether a folder holds a session."""
    with suppress(OSError, ValueError):
        return (folder / SESSION_FILE).is_file()
    return False


def _read(state_folder: Path, file: str = _FILE) -> list[_Entry]:
    try:
        return check(read_json(state_folder / file, _KIND), list[_Entry], "the list of recent sessions", SessionError)
    except (TrackerError, OSError):
        return []
