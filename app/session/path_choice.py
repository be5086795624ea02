"""Paths that a user types or chooses in the page: check them, complete them, list what is in a folder."""

import os
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Annotated, NamedTuple

from msgspec import Meta

from app.session.recent_sessions import is_session
from tracker.errors import SessionError
from tracker.footage.chapters import VIDEO_SUFFIXES

TypedPath = Annotated[str, Meta(min_length=1, max_length=4096, description="a path")]
"""A path as it comes from the page; `typed_path` checks it."""
TypedPaths = Annotated[str, Meta(min_length=1, max_length=100_000, description="a path, or several")]
"""One path, or several separated by semicolons; `typed_paths` checks them."""
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


def typed_paths(text: str) -> list[Path]:
    """Return the paths that a user typed or marked: one, or several separated by semicolons.

    A name without a folder lies beside the path before it.

    Raises:
        SessionError: one of them is relative, or no path.
    """
    whole = typed_path(text)
    if ";" not in text or os.path.exists(whole):
        return [whole]
    paths: list[Path] = []
    for part in filter(None, map(str.strip, text.split(";"))):
        paths.append(paths[-1].parent / part if paths and "/" not in part else typed_path(part))
    return paths


class Entry(NamedTuple):
    """A folder or file that a user can choose."""

    name: str
    path: str
    kind: str
    """`folder`, `session`, `video` or `file`."""


class FolderContents(NamedTuple):
    """Content of a folder."""

    folder: str
    parent: str | None
    """Its parent; None at the root."""
    entries: list[Entry]
    """Folders first; neither hidden ones, nor what is no regular file."""
    is_cut_off: bool
    """Whether there are more than `_MAX_READ` entries."""


def folder_contents(text: str) -> FolderContents:
    """Return the folders and regular files in the folder that a user has chosen, or that holds the file.

    Args:
        text: a path; empty for the user's home.

    Raises:
        SessionError: it is no path, or its folder cannot be read.
    """
    folder = typed_path(text or "~")
    if not folder.is_dir():
        folder = folder.parent
    folder = Path(os.path.abspath(folder))  # without `..`
    try:
        with os.scandir(folder) as found:
            read = list(islice(found, _MAX_READ + 1))
    except (OSError, ValueError) as error:
        raise SessionError(f"expected a folder that can be read, found {folder} ({_reason(error)})") from error
    kinds = ((e, _kind(e)) for e in read[:_MAX_READ] if not e.name.startswith("."))
    entries = [Entry(e.name, e.path, kind) for e, kind in kinds if kind is not None]
    entries.sort(key=lambda e: (e.kind not in ("folder", "session"), e.name.casefold()))
    parent = None if folder.parent == folder else str(folder.parent)
    return FolderContents(str(folder), parent, entries, len(read) > _MAX_READ)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _kind(entry: "os.DirEntry[str]") -> str | None:
    """Return the kind of an entry; None for what can be neither opened nor read: pipes, sockets, broken links."""
    if _is_folder(entry):
        return "session" if is_session(Path(entry.path)) else "folder"
    try:
        if not entry.is_file():
            return None
    except OSError:
        return None
    return "video" if Path(entry.name).suffix.lower() in VIDEO_SUFFIXES else "file"


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
