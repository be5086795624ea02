"""A program that holds something, such as the lock of a session: its system, its process and when it began.

A number of a process means a program only on its own system, within its container, until the number is used again.
"""

import hashlib
import os
import secrets
import socket
import sys
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

import msgspec
from msgspec import Meta

from tracker.files import read_regular

_FIRST_NAMESPACE = "pid:[4026531836]"
"""The namespace of processes outside of any container (`PROC_PID_INIT_INO` of Linux)."""

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
        start_of(os.getpid()),
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
    if holder.host != here.host or sys.platform == "win32":  # signal 0 would end the process on Windows
        return True
    if holder.boot and holder.boot != here.boot:
        # Machines and containers may share a name. This one was started again if it is the same installation.
        is_known = bool(holder.machine) and holder.namespace == _FIRST_NAMESPACE
        return not (is_known and (holder.machine, holder.namespace) == (here.machine, here.namespace))
    if holder.boot and holder.namespace != here.namespace:
        return True  # in another container, where the number means another process
    try:
        os.kill(holder.process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    if _has_ended(holder.process):
        return False
    started = start_of(holder.process)
    return not holder.started or not started or holder.started == started


def start_of(process: int) -> str:
    """Return the start time of a process, in ticks since boot; empty if the system does not provide it."""
    fields = _fields_of(process)
    return fields[19] if fields else ""  # field 22


def _has_ended(process: int) -> bool:
    """Return whether a process has ended, though the one that started it has not asked for its status yet."""
    fields = _fields_of(process)
    return bool(fields) and fields[0] in "ZX"


def _fields_of(process: int) -> list[str]:
    """Return the fields that the system gives of a process, from its state (field 3) on; none if it gives none."""
    try:
        stat = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")  # a program may have any name
    except OSError:
        return []
    return stat.rpartition(")")[2].split()  # the program's name, in parentheses, may contain spaces


class System(NamedTuple):
    """The system that a program runs on; see `Holder`."""

    host: str
    boot: str
    namespace: str
    machine: str


@cache
def this_system() -> System:
    """Identify this system; empty words where it does not provide them."""
    namespace = ""
    with suppress(OSError):
        namespace = os.readlink("/proc/self/ns/pid")
    machine = _first_line("/etc/machine-id")
    # The manual of machine-id asks programs to show a hash of it alone.
    hashed = hashlib.sha256(f"quadrille {machine}".encode()).hexdigest()[:16] if machine else ""
    return System(socket.gethostname()[:300], _first_line("/proc/sys/kernel/random/boot_id"), namespace, hashed)


def _first_line(path: str) -> str:
    try:
        return Path(path).read_text("utf-8", "replace").strip()[:300]
    except OSError:
        return ""
