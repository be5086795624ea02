"""Read regular files alone, write files atomically and never through links, and look through folders within bounds."""

import contextlib
import os
import secrets
import stat
import time
from collections import deque
from collections.abc import Callable, Iterator
from io import BufferedReader
from pathlib import Path
from typing import NamedTuple

from tracker import system
from tracker.errors import SessionError, TrackerError


class WalkLimits(NamedTuple):
    """Bounds of a walk through folders."""

    entries: int = 1_000_000
    """Files and folders at most: ten cameras with a file for each picture, half an hour at 50 Hz."""
    depth: int = 32
    """Folders within each other at most: below a path of 4096 characters, the system's limit, few have more."""
    seconds: float = 20.0
    """Time at most: a page waits for it."""


LIMITS = WalkLimits()


class IrregularFileError(OSError):
    """A path names a pipe, a device or a socket; reading one may wait for ever."""


def open_regular(path: Path) -> BufferedReader:
    """Open a file to read its bytes, without waiting for a writer.

    Raises:
        IrregularFileError: it is a named pipe, a device or a socket.
        OSError: it is missing, a folder, or cannot be read.
    """
    check_regular(path)  # opening a device may have effects
    number = os.open(path, system.READ_FLAGS)
    try:
        _check_mode(os.fstat(number).st_mode, path)  # another file may have taken its place
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_regular(path: Path, max_bytes: int) -> bytes:
    """Read a file, at most `max_bytes` and one more. Raises as `open_regular` does."""
    with open_regular(path) as file:
        return file.read(max_bytes + 1)


def check_regular(*paths: Path) -> None:
    """Check paths before another library opens them. Files that are missing pass, and folders.

    Raises:
        IrregularFileError: one is a named pipe, a device or a socket.
    """
    for path in paths:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            _check_mode(os.stat(path).st_mode, path)


def _check_mode(mode: int, path: Path) -> None:
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        kind = "a named pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"
        raise IrregularFileError(0, f"expected a regular file, found {kind}", str(path))


def write_text_atomic(path: Path, text: str, mode: int = 0o666) -> None:
    """Write UTF-8 text; see `write_bytes_atomic`."""
    write_bytes_atomic(path, text.encode("utf-8"), mode)


def write_bytes_atomic(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write bytes to a temporary sibling, then rename it to `path`: a crash leaves the old file or the new one.

    Args:
        path: the file.
        data: its content.
        mode: permissions, less those that the process masks; 0o600 for a file of this user alone.

    Raises:
        OSError: the folder is missing or not writable, or the disk is full.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        opened = os.open(temporary, system.NEW_FLAGS, mode)
        with open(opened, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):  # a full disk names no file, others the temporary one
            error.filename = str(path)
        raise


def refuse_links(folder: Path, *names: str) -> None:
    """Refuse to write files of a session through symbolic links, which may lead out of its folder.

    Args:
        folder: of the session; may be reached through links itself.
        names: paths within it of what is to be written; the folders on the way are checked too.

    Raises:
        SessionError: one of them is a link.
    """
    for name in names:
        path = folder
        for part in Path(name).parts:
            path = path / part
            if path.is_symlink():
                raise SessionError(
                    f"{path} is a symbolic link, and nothing is written through links inside a session; "
                    "put the file or folder itself there"
                )


def sync_folder(folder: Path) -> None:
    """Bring the names of new and renamed files of a folder to the disk, where the system can."""
    with contextlib.suppress(OSError):  # Windows cannot open folders
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def entries_below(
    folder: Path, error: type[TrackerError], enters: bool = True, passes_unreadable: bool = False
) -> "Iterator[os.DirEntry[str]]":
    """Yield the files and folders in a folder and in those inside; links to folders are not followed.

    Args:
        folder: to look through; may be a link itself.
        error: kind of error to raise.
        enters: whether folders inside are looked through, too.
        passes_unreadable: whether folders inside that cannot be read are passed over.

    Raises:
        TrackerError: it is no folder that can be read, or a bound is reached.
    """
    limits = LIMITS
    end, n, waiting = time.monotonic() + limits.seconds, 0, deque([(folder, 1)])
    while waiting:
        at, depth = waiting.popleft()
        if depth > limits.depth:
            raise error(
                f"expected at most {limits.depth} folders within each other, found more at {at}; name one further in"
            )
        for entry in _read(at, error, passes_unreadable and at != folder):
            n += 1
            if n > limits.entries or time.monotonic() > end:
                raise error(
                    f"expected at most {limits.entries} files and folders in {folder}, looked through within "
                    f"{limits.seconds:g} s, found more after {n - 1}; name a folder further in"
                )
            if enters and entry.is_dir(follow_symlinks=False):
                waiting.append((Path(entry.path), depth + 1))
            yield entry


def paths_in(folder: Path, error: type[TrackerError], accepts: Callable[[str], bool] = lambda _: True) -> list[Path]:
    """Return the files and folders in a folder whose names do not begin with a dot, by name.

    Args:
        folder: to look into.
        error: kind of error to raise.
        accepts: whether a name is wanted.

    Raises:
        TrackerError: it is no folder that can be read, or has too many entries.
    """
    found = (entry.name for entry in entries_below(folder, error, enters=False))
    return sorted(folder / name for name in found if not name.startswith(".") and accepts(name))


def _read(folder: Path, error: type[TrackerError], passes_unreadable: bool) -> "Iterator[os.DirEntry[str]]":
    try:
        with os.scandir(folder) as found:
            yield from found
    except (OSError, ValueError) as reason:
        if not passes_unreadable:
            why = getattr(reason, "strerror", None) or reason
            raise error(
                f"expected a folder that can be read, found that {folder} cannot be ({why}); check the path and that "
                "you may read it"
            ) from reason
