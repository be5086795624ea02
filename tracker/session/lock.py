"""The lock of a session for one writer: a file that names the holder's program, machine and time.

A lock file works on network drives, where the system's own locks are unreliable. A lock left by a dead program is
recognized on the machine on which it ran; a lock of another machine counts as held.

`filelock.SoftFileLock` would replace only the exclusive creation of the file. The holder's note, the recognition of
reused process numbers and the safe replacement of a stale lock would remain.
"""

import json
import os
import secrets
import socket
import time
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta

from tracker.errors import SessionError
from tracker.files import refuse_links
from tracker.text_files import TextKind, read_json
from tracker.validation import check

LOCK_FILE = "lock.json"

_KIND = TextKind("lock", 10_000, SessionError)
_WRITING_S = 0.2  # an unreadable lock file may be in the process of being written


_Word: TypeAlias = Annotated[str, Meta(max_length=300)]


class Holder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The holder of a lock."""

    host: _Word
    process: Annotated[int, Meta(ge=1, le=2**31 - 1, description="the number of a process")]
    started: _Word
    """Start time of the process according to the system; empty if unknown. Process numbers are reused."""
    since: _Word
    """Time at which the lock was taken, ISO 8601."""
    token: _Word
    """Identifies this lock uniquely."""


class SessionLock:
    """The right to write a session; a context manager.

    Raises:
        SessionError: on entering, if another program holds the session or the folder cannot be written.
    """

    def __init__(self, folder: str | Path) -> None:
        self._path = Path(folder) / LOCK_FILE
        self._held: Holder | None = None

    def __enter__(self) -> "SessionLock":
        self.acquire()
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.release()

    def acquire(self) -> None:
        """Acquire the lock. A lock that a dead program of this machine left is replaced.

        Raises:
            SessionError: another program holds it, or the folder cannot be written.
        """
        refuse_links(self._path.parent, LOCK_FILE)
        me = Holder(
            socket.gethostname(),
            os.getpid(),
            _start_of(os.getpid()),
            datetime.now(UTC).isoformat(timespec="seconds"),
            secrets.token_hex(8),
        )
        try:
            while not self._create(me):
                self._clear_stale()
        except OSError as error:
            raise SessionError(
                f"cannot write {self._path}: {error.strerror}; open the session where you may write"
            ) from error
        self._held = me

    def release(self) -> None:
        """Release the lock, if it is held."""
        if self._held is not None and _read(self._path) == self._held:
            self._path.unlink(missing_ok=True)
        self._held = None

    def _create(self, me: Holder) -> bool:
        """Create the lock file; return False if there is one already."""
        try:
            # Exclusive creation: of two programs at the same time, one fails. Hard links would make the content appear
            # atomically too, but some network drives lack them.
            with self._path.open("x", encoding="utf-8") as file:
                json.dump(msgspec.to_builtins(me), file)
        except FileExistsError:
            return False
        return True

    def _clear_stale(self) -> None:
        """Remove the lock file if its program is dead, else raise."""
        holder = _read(self._path)
        if holder is None:
            time.sleep(_WRITING_S)
            holder = _read(self._path)
        if holder is None and not self._path.exists():
            return  # released in the meantime
        if holder is None or _is_alive(holder):
            raise SessionError(f"session {self._path.parent} is open already {_describe(holder, self._path)}")
        # Another program may replace it at the same time: each one checks the file that it has moved away.
        aside = self._path.with_name(f".{LOCK_FILE}.stale.{secrets.token_hex(8)}")
        try:
            self._path.rename(aside)
        except FileNotFoundError:
            return
        if _read(aside) == holder:
            aside.unlink()
        else:
            aside.rename(self._path)


def _read(path: Path) -> Holder | None:
    """Read a lock; None if it is missing, incomplete or damaged."""
    try:
        holder: Holder = check(read_json(path, _KIND), Holder, f"lock {path}", SessionError)
    except SessionError:
        return None
    return holder


def _describe(holder: Holder | None, path: Path) -> str:
    if holder is None:
        return f"and its lock {path} cannot be read; close the other program, or delete that file if there is none"
    if holder.host == socket.gethostname() and holder.process == os.getpid():
        return f"in this program since {holder.since}; go on there"
    return (
        f"in process {holder.process} on {holder.host} since {holder.since}; close it there, "
        f"or delete {path} if that program no longer runs"
    )


def _is_alive(holder: Holder) -> bool:
    """Return whether the holder may still run; only a process that is certainly gone counts as dead."""
    if holder.host != socket.gethostname():
        return True
    if os.name == "nt":  # signal 0 would end the process on Windows
        return True
    try:
        os.kill(holder.process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    started = _start_of(holder.process)
    return not holder.started or not started or holder.started == started


def _start_of(process: int) -> str:
    """Return the start time of a process, in ticks since boot; empty if the system does not provide it."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")  # a program may have any name
    except OSError:
        return ""
    # The program's name, in parentheses, may contain spaces. The start time is field 22, the 20th after the name.
    return stat.rpartition(")")[2].split()[19]
