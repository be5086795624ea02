"""The lock of a session for one writer: a file that names the holder's program, machine and time.

A lock file works on network drives, where the system's own locks are unreliable. A lock left by a dead program is
recognized on the machine on which it ran; a lock of another machine or container counts as held.

`filelock.SoftFileLock` would replace only the exclusive creation of the file. The holder's note, the recognition of
reused process numbers and the safe replacement of a stale lock would remain.

A program that holds something, such as the lock of a session: its system, its process and when it began.

A number of a process means a program only on its own system, within its container, until the number is used again.
"""

import json
import os
import secrets
import socket
import time
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Annotated, NamedTuple, TypeAlias

import msgspec
from msgspec import Meta

from tracker import system
from tracker.errors import SessionError
from tracker.files import read_regular, refuse_links
from tracker.validation import check

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
    boot: _Word = ""
    """Identifies the system since it was started; empty if unknown, as in locks of older programs."""
    namespace: _Word = ""
    """Namespace of the number of the process: each container has its own. Empty if unknown."""
    machine: _Word = ""
    """Identifies the installation of the system, as a hash; empty if unknown."""


def this_holder() -> Holder:
    """Return this program as a holder, with a token of its own."""
    here = this_system()
    return Holder(
        here.host,
        os.getpid(),
        system.start_of(os.getpid()),
        datetime.now(UTC).isoformat(timespec="seconds"),
        secrets.token_hex(8),
        here.boot,
        here.namespace,
        here.machine,
    )


def read_holder(path: Path) -> Holder | None:
    """Return the holder that a file names; None if it cannot be read."""
    try:
        return msgspec.json.decode(read_regular(path, 10_000), type=Holder)
    except (OSError, msgspec.DecodeError):
        return None


def is_of_this_system(holder: Holder) -> bool:
    """Return whether the number of a holder's process means a process of this system."""
    here = this_system()
    return (holder.host, holder.boot, holder.namespace) == (here.host, here.boot, here.namespace)


def is_alive(holder: Holder) -> bool:
    """Return whether the holder may still run; only a process that is certainly gone counts as dead."""
    here = this_system()
    if holder.host != here.host:
        return True
    if holder.boot and holder.boot != here.boot:
        # Machines and containers may share a name. This one was started again if it is the same installation.
        is_known = bool(holder.machine) and holder.namespace == system.FIRST_NAMESPACE
        return not (is_known and (holder.machine, holder.namespace) == (here.machine, here.namespace))
    if holder.boot and holder.namespace != here.namespace:
        return True  # in another container, where the number means another process
    return system.is_running(holder.process, holder.started)


class System(NamedTuple):
    """The system that a program runs on; see `Holder`."""

    host: str
    boot: str
    namespace: str
    machine: str


@cache
def this_system() -> System:
    """Identify this system; empty words where it does not provide them."""
    return System(socket.gethostname()[:300], system.boot(), system.namespace(), system.machine())


LOCK_FILE = "lock.json"

_MAX_BYTES = 10_000
"""Size of a lock file that is read: a lock holds some short texts."""
_WRITING_S = 2.0
"""Time after which a lock file without content is one that a full disk or a power cut left, s. Its writer, where the
file does not appear whole, takes milliseconds."""
_LOOK_S = 0.05
"""Time between two looks at a lock, s."""
_held_here: set[str] = set()
"""Tokens of the locks that this program holds."""


def is_held_here(folder: Path) -> bool:
    """Return whether this program holds the lock of a session."""
    holder = _read(folder / LOCK_FILE)
    return holder is not None and holder.token in _held_here


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
        """Acquire the lock. A lock that a dead program of this machine left is replaced, and one without content.

        Raises:
            SessionError: another program holds it, or the folder cannot be written.
        """
        refuse_links(self._path.parent, LOCK_FILE)
        me = this_holder()
        try:
            while not self._create(me):
                self._clear_stale()
        except OSError as error:
            raise SessionError(
                f"cannot write {self._path}: {error.strerror}; open the session where you may write"
            ) from error
        self._held = me
        _held_here.add(me.token)

    def release(self) -> None:
        """Release the lock, if it is held."""
        if self._held is None:
            return
        if _read(self._path) == self._held:
            with suppress(OSError):  # a drive that is away; the lock then counts as left by a dead program
                self._path.unlink()
        _held_here.discard(self._held.token)
        self._held = None

    def _create(self, me: Holder) -> bool:
        """Create the lock file; return False if there is one already. A failure leaves none."""
        text = json.dumps(msgspec.to_builtins(me))
        temporary = self._path.with_name(f".{LOCK_FILE}.{me.token}.tmp")
        try:
            temporary.write_text(text, "utf-8")
            os.link(temporary, self._path)  # it appears with its content
        except FileExistsError:
            return False
        except OSError:  # some network drives have no hard links
            return self._create_in_place(text)
        finally:
            with suppress(OSError):
                temporary.unlink()
        return True

    def _create_in_place(self, text: str) -> bool:
        """Create the lock file and then write it."""
        try:
            file = self._path.open("x", encoding="utf-8")  # of two programs at the same time, one fails
        except FileExistsError:
            return False
        try:
            with file:
                file.write(text)
                file.flush()
                return self._is_at_path(file.fileno())
        except BaseException:
            self._path.unlink(missing_ok=True)  # without its content it would block the session
            raise

    def _clear_stale(self) -> None:
        """Remove the lock file if its program is dead or has left it without content, else raise."""
        data = self._settled()
        if data is None:
            return  # released in the meantime
        holder = _parse(data)
        if not (len(data) <= _MAX_BYTES and not data.strip(b"\0")) and (holder is None or is_alive(holder)):
            raise SessionError(f"session {self._path.parent} is open already {_describe(holder, self._path)}")
        is_stale = False
        with suppress(FileNotFoundError), self._path.open("rb+") as file:
            # Several programs may find the same stale lock. The one that has this file to itself removes it; to the
            # others it is no longer the file at the path.
            if not _have_alone(file.fileno()):
                raise SessionError(f"session {self._path.parent} is being opened by another program; try again")
            is_stale = self._is_at_path(file.fileno()) and file.read(_MAX_BYTES + 1) == data
            if is_stale and not system.KEEPS_OPEN_FILES:
                self._path.unlink()
        if is_stale and system.KEEPS_OPEN_FILES:
            self._path.unlink(missing_ok=True)

    def _settled(self) -> bytes | None:
        """Read the lock file, once it has been written; None if it is missing."""
        until = time.monotonic() + _WRITING_S
        while True:
            try:
                data = read_regular(self._path, _MAX_BYTES)
            except FileNotFoundError:
                return None
            except OSError as error:  # not a file, or that of another account
                raise SessionError(
                    f"session {self._path.parent} is open already {_describe(None, self._path)}"
                ) from error
            if _parse(data) is not None or time.monotonic() >= until:
                return data
            time.sleep(_LOOK_S)

    def _is_at_path(self, number: int) -> bool:
        """Return whether an open file is still the lock file."""
        try:
            return os.path.samestat(os.fstat(number), os.stat(self._path))
        except FileNotFoundError:
            return False


def _read(path: Path) -> Holder | None:
    """Read a lock; None if it is missing, incomplete or damaged."""
    try:
        return _parse(read_regular(path, _MAX_BYTES))
    except OSError:
        return None


def _parse(data: bytes) -> Holder | None:
    """Return the holder that a lock file names; None if it is incomplete or damaged."""
    try:
        holder: Holder = check(msgspec.json.decode(data[:_MAX_BYTES]), Holder, "lock", SessionError)
    except (SessionError, ValueError, RecursionError):  # of msgspec and of texts, too
        return None
    return holder


def _have_alone(number: int) -> bool:
    """Keep other programs of this machine from having an open file alone, until it is closed; False if one has it."""
    until = time.monotonic() + _WRITING_S
    while True:
        try:
            if system.lock_at_once(number):
                return True
        except OSError:  # a drive without such locks
            return True
        if time.monotonic() >= until:
            return False
        time.sleep(_LOOK_S)


def _describe(holder: Holder | None, path: Path) -> str:
    if holder is None:
        return f"and its lock {path} cannot be read; close the other program, or delete that file if there is none"
    here = this_system()
    if (holder.host, holder.boot, holder.namespace) == here[:3] and holder.process == os.getpid():
        return f"in this program since {holder.since}; go on there"
    who = f"in process {holder.process} on {holder.host} since {holder.since}"
    if holder.host == here.host and holder.boot and holder.boot != here.boot:
        return (
            f"{who}, by a program from before this system was started, or of another machine or container of that "
            f"name; delete {path} if it is from before, else close it there"
        )
    if holder.host == here.host and holder.boot and holder.namespace != here.namespace:
        return f"{who}, in another container; close it there, or delete {path} if that container has ended"
    return f"{who}; close it there, or delete {path} if that program no longer runs"
