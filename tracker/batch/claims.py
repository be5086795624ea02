"""Claims of tasks: a file that one worker makes, and touches as long as it lives.

Files work between processes, machines of a job array and workers of a cluster, as long as they share a folder. A claim
whose process is gone is one that a dead worker left, and so is one of another machine that nobody has touched for
`DEAD_S`: the task is taken again.
"""

import os
import secrets
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

import msgspec

from tracker.session.lock import LOCK_FILE, Holder, is_alive, is_of_this_system, read_holder, this_holder

BEAT_S = 2.0
"""Time between two signs of life of a worker, s."""
DEAD_S = 60.0
"""Time without one after which a worker of another machine counts as dead, s: thirty beats, because network drives
show times late."""


@dataclass(frozen=True)
class Claim:
    """The right to do a task, as long as the file is of this holder."""

    path: Path
    holder: Holder
    dead: Holder | None = None
    """The dead worker who had the task before; None without one."""

    def is_held(self) -> bool:
        """Return whether no other worker has taken the task since."""
        return read_holder(self.path) == self.holder

    def release(self) -> None:
        """Give the task back, unless another worker has taken it."""
        if self.is_held():
            self.path.unlink(missing_ok=True)

    def free_session(self, folder: Path) -> None:
        """Remove the lock that the dead worker left on a session. Locks of others stay."""
        lock = folder / LOCK_FILE
        left = read_holder(lock)
        if left is not None and self.dead is not None and _process(left) == _process(self.dead):
            lock.unlink(missing_ok=True)

    @contextmanager
    def beating(self) -> Generator[None, None, None]:
        """Show signs of life within the context, from a thread of their own."""
        ended = threading.Event()

        def beat() -> None:
            while not ended.wait(BEAT_S):
                if self.is_held():
                    with suppress(OSError):
                        os.utime(self.path)

        thread = threading.Thread(target=beat, daemon=True, name="heartbeat")
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


def claim(path: Path) -> Claim | None:
    """Claim a task by its file, whose folder exists. Returns None if another worker has it."""
    dead = None
    if path.exists():
        if has_living(path):
            return None
        dead = _take_away(path)
        if dead is None and path.exists():
            return None
    me = this_holder()
    temporary, text = path.with_name(f".{path.name}.{me.token}.tmp"), msgspec.json.encode(me)
    try:
        temporary.write_bytes(text)
        os.link(temporary, path)  # it appears with its content, once
    except FileExistsError:
        return None
    except OSError:  # a drive without hard links
        try:
            with path.open("xb") as file:
                file.write(text)
        except FileExistsError:
            return None
        except OSError:
            path.unlink(missing_ok=True)  # without its content it would hold up others
            raise
    finally:
        temporary.unlink(missing_ok=True)
    return Claim(path, me, dead)


def has_living(path: Path) -> bool:
    """Return whether a worker that lives has claimed a task."""
    try:
        touched = path.stat().st_mtime
    except FileNotFoundError:
        return False
    holder = read_holder(path)
    if holder is not None and is_of_this_system(holder):
        return is_alive(holder)
    # A clock that was wrong leaves a time to come, which no worker that lives shows.
    has_beaten = abs(_now(path.parent) - touched) < DEAD_S
    return has_beaten and (holder is None or is_alive(holder))  # without one it is being written, or was cut


def _now(folder: Path) -> float:
    """Return the present time of the system that keeps a folder, s: clocks of machines differ."""
    try:
        with TemporaryFile(dir=folder) as file:
            return os.fstat(file.fileno()).st_mtime
    except OSError:  # a folder that this program may only read
        return time.time()


def _take_away(path: Path) -> Holder | None:
    """Remove the claim of a dead worker, and return that; None if another worker was quicker."""
    before = read_holder(path)
    aside = path.with_name(f".{path.name}.{secrets.token_hex(8)}.dead")
    try:
        os.rename(path, aside)  # of several workers that find it, one gets it
    except FileNotFoundError:
        return None
    holder = read_holder(aside)
    if holder != before:  # another worker has replaced it meanwhile, and gets it back
        with suppress(OSError):
            os.link(aside, path)
        holder = None
    with suppress(OSError):  # a folder
        aside.unlink()
    return holder


def _process(holder: Holder) -> tuple[str, str, str, int, str]:
    return holder.host, holder.boot, holder.namespace, holder.process, holder.started
