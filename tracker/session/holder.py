"""A program that holds something, such as the lock of a session: its system, its process and when it began.

A number of a process means a program only on its own system, within its container, until the number is used again.
"""

import os
import secrets
import socket
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

import msgspec
from msgspec import Meta

from tracker import system
from tracker.files import read_regular

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
