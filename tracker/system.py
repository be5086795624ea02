"""All in which operating systems differ: locks, processes, signals, sockets, private files, memory.

No other module names a call that one system alone has; a test looks. QUADRILLE_PORTABLE=1 takes the ways that Windows
takes, as far as this system has them, so that their tests run anywhere.
"""

import ctypes
import hashlib
import multiprocessing
import os
import re
import signal
import socket
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

IS_PORTABLE = sys.platform == "win32" or os.environ.get("QUADRILLE_PORTABLE") == "1"
"""Whether neither Unix sockets, nor forks, nor the files in `/proc` of Linux are used."""
_IS_LINUX = sys.platform.startswith("linux") and not IS_PORTABLE
FORKS = _IS_LINUX
"""Whether a process may begin as a copy of this one. macOS has forks that its own libraries do not survive."""
HAS_UNIX_SOCKETS = not IS_PORTABLE and hasattr(socket, "AF_UNIX")
MAX_SOCKET_PATH_BYTES = 100
"""Longest path of a Unix socket that all systems take: their limits are 104 to 108 bytes."""
KEEPS_OPEN_FILES = sys.platform == "win32"
"""Whether a file cannot be removed while it is open."""
HAS_BROWSER = sys.platform in ("darwin", "win32")
"""Whether the system has a browser of its own."""
ENDING_SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name))
"""Signals that ask a program to end: by another program, by the end of its terminal, by Windows."""
PIPE_OF_SHELL = re.compile(r"/dev/fd/\d+|/proc/self/fd/\d+")
"""Path that a shell gives to a program for the output of another one, as in `<(command)`."""
FIRST_NAMESPACE = "pid:[4026531836]"
"""The namespace of processes outside of any container (`PROC_PID_INIT_INO` of Linux)."""
_M_ARENA_MAX = -8
"""Option of `mallopt` (malloc.h): largest number of heaps."""
_PR_SET_THP_DISABLE = 41
"""Option of `prctl` (linux/prctl.h), since Linux 3.15."""
_NICENESS = 10
"""Priority of threads whose results can wait, as of `nice`."""
_END_S = 10.0
"""Time for a program to end once it is asked to, s."""
_BINARY = getattr(os, "O_BINARY", 0)
"""Windows changes line ends otherwise."""
READ_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | _BINARY
"""To open a file for its bytes, without waiting for a writer."""
NEW_FLAGS = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY
"""To make a file that must not exist."""

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


# Files.


def lock_at_once(number: int) -> bool:
    """Keep other programs of this machine from having an open file alone, until it is closed; False if one has it.

    Raises:
        OSError: the drive has no such locks.
    """
    try:
        if sys.platform == "win32":
            msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


def open_unlinked(path: Path) -> int:
    """Open a file for its bytes, but not through a link, where the system can tell. Raises OSError."""
    return os.open(path, READ_FLAGS | getattr(os, "O_NOFOLLOW", 0))


def is_mine(found: os.stat_result) -> bool:
    """Return whether a file is of this account; files of Windows always are."""
    return not hasattr(os, "getuid") or found.st_uid == os.getuid()


def is_private(found: os.stat_result) -> bool:
    """Return whether a file is of this account, and no other may read it. Windows keeps a user's own folders so."""
    return is_mine(found) and (sys.platform == "win32" or not stat.S_IMODE(found.st_mode) & 0o077)


# Processes.


def is_running(process: int, started: str) -> bool:
    """Return whether a process may still run; only one that is certainly gone does not.

    Args:
        process: its number.
        started: when it began, by `start_of`; empty if unknown.
    """
    if not psutil.pid_exists(process):
        return False
    with suppress(psutil.Error):  # some systems tell nothing of processes of other accounts
        if psutil.Process(process).status() in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
            return False  # it ended, and nobody has asked for its status yet
    now = start_of(process)
    return not started or not now or now == started


def start_of(process: int) -> str:
    """Return when a process began, so that a number that is used again means another one; empty if unknown."""
    if _IS_LINUX:  # ticks since boot, which no change of the clock moves
        with suppress(OSError):
            text = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")  # a program may have any name
            return text.rpartition(")")[2].split()[19]  # field 22; the name, in parentheses, may contain spaces
        return ""
    try:
        return f"{psutil.Process(process).create_time():.0f}"
    except psutil.Error:
        return ""


def boot() -> str:
    """Identify this system since it was started; empty if unknown."""
    return _first_line("/proc/sys/kernel/random/boot_id")


def namespace() -> str:
    """Return the namespace of numbers of processes: each container has its own. Empty if unknown."""
    with suppress(OSError):
        return os.readlink("/proc/self/ns/pid")
    return ""


def machine() -> str:
    """Identify the installation of the system, as a hash, which its manual asks for; empty if unknown."""
    found = _first_line("/etc/machine-id")
    return hashlib.sha256(f"quadrille {found}".encode()).hexdigest()[:16] if found else ""


def _first_line(path: str) -> str:
    try:
        return Path(path).read_text("utf-8", "replace").strip()[:300]
    except OSError:
        return ""


def own_module(name: str) -> list[str]:
    """Return the words that run a module of this program as one, also where another package of its name comes first."""
    place = str(Path(__file__).resolve().parents[1])
    run = f"import runpy, sys; sys.path.insert(0, {place!r}); runpy.run_module({name!r}, run_name='__main__')"
    return [sys.executable, "-P", "-c", run]


def start_detached(command: Sequence[str], **more: Any) -> "subprocess.Popen[bytes]":
    """Start a program that Ctrl+C in this one's terminal does not reach; `end_apart` ends it."""
    if sys.platform == "win32":
        return subprocess.Popen(command, creationflags=subprocess.CREATE_NEW_PROCESS_GROUP, **more)
    return subprocess.Popen(command, start_new_session=True, **more)


def end_apart(process: "subprocess.Popen[bytes]") -> None:
    """End a program, and what it has started, and wait for it."""
    with suppress(psutil.Error):
        found = psutil.Process(process.pid)
        whole = [*found.children(recursive=True), found]
        for each in whole:
            with suppress(psutil.Error):
                each.terminate()
        _, left = psutil.wait_procs(whole[:-1], _END_S)
        for each in left:
            with suppress(psutil.Error):
                each.kill()
    process.wait()


def start_child(work: Callable[..., None], *arguments: Any) -> Any:
    """Start work in a process that ends with this one: a copy where the system has them, else a new interpreter."""
    context: Any = multiprocessing.get_context("fork" if FORKS else "spawn")
    process = context.Process(target=work, args=arguments, daemon=True)
    process.start()
    return process


def lower_priority() -> None:
    """Lower the priority of this process below all that somebody waits for."""
    if sys.platform == "win32":
        psutil.Process().nice(psutil.IDLE_PRIORITY_CLASS)
    else:
        os.nice(19)


def give_way_in_thread() -> None:
    """Lower the priority of this thread alone, where the system has that."""
    if _IS_LINUX:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


# Sockets.


def private_listener(folder: Path) -> tuple[socket.socket, Path | None]:
    """Return a socket that listens for this program alone, and its path: in a folder that only this user may enter.

    Without Unix sockets it is a port of this machine, and the path is None: a request needs a secret.
    """
    if not HAS_UNIX_SOCKETS:
        return socket.create_server(("127.0.0.1", 0)), None
    path = folder / "viser"
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    listener.bind(str(path))
    return listener, path


# Memory and cores.


def free_bytes() -> int:
    """Return the memory that programs can still have, bytes."""
    return int(psutil.virtual_memory().available)


def n_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def limit_memory(n_bytes: int) -> None:
    """Limit the memory of this process, where the system can."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (n_bytes, n_bytes))


def heap_trimmer() -> Callable[[], None] | None:
    """Keep the heaps of the C library few and their pages small; return what trims them, None if it is not glibc."""
    libc = ctypes.CDLL(None) if _IS_LINUX else None
    trim = getattr(libc, "malloc_trim", None)
    if libc is None or trim is None:
        return None
    libc.mallopt(_M_ARENA_MAX, os.cpu_count() or 1)
    libc.prctl(_PR_SET_THP_DISABLE, 1, 0, 0, 0)  # old kernels refuse it: more memory is resident then
    return lambda: trim(0)  # releases the interpreter's lock
