"""Paths that a user types in the page: check them, and complete them."""

import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from app.session.recent_sessions import is_session
from tracker.errors import SessionError

_MAX_READ = 5000
"""Largest number of entries of a folder that are looked at."""
_MAX_SHOWN = 40


def typed_path(text: str) -> Path:
    """Return the path that a user typed: absolute, or in the user's home.

    Raises:
        SessionError: it is relative, or no path.
    """
    if "\0" in text or not text.strip():
        raise SessionError("expected a path, found none; type one, such as ~/recordings/walk")
    path = Path(text.strip())
    try:
        path = path.expanduser()
    except RuntimeError as error:
        raise SessionError(f"expected a user of this machine in '{text}', found none; type the whole path") from error
    if not path.is_absolute():
        raise SessionError(f"expected a path from the root or from ~, found '{text}'; type the whole path")
    return path


def completions(text: str) -> list[tuple[str, bool]]:
    """Return the files and folders that complete what a user has typed, folders first and with a slash at the end.

    Returns:
        Their paths, with whether each holds a session.
    """
    try:
        path = typed_path(text)
    except SessionError:
        return []
    parent, start = (path, "") if text.endswith("/") else (path.parent, path.name)
    entries = sorted(_entries(parent, start), key=lambda e: (not _is_folder(e), e.name.casefold()))[:_MAX_SHOWN]
    return [(e.path + "/" * _is_folder(e), _is_folder(e) and is_session(Path(e.path))) for e in entries]


def _entries(folder: Path, start: str) -> Iterator["os.DirEntry[str]"]:
    """Yield the entries of a folder whose name begins so; hidden ones only if it begins with a dot."""
    try:
        with os.scandir(folder) as found:
            for entry in islice(found, _MAX_READ):
                is_wanted = entry.name.casefold().startswith(start.casefold())
                if is_wanted and (start.startswith(".") or not entry.name.startswith(".")):
                    yield entry
    except (OSError, ValueError):
        return


def _is_folder(entry: "os.DirEntry[str]") -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False
