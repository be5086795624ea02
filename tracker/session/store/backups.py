"""Backups of a store: the last few that passed their checks at opening, and going back to one of them.

Their names hold a counter, because a clock may have been ahead, and the time, for people.

Open a store for reading although a crash in the middle of a commit has left its journal.

SQLite rolls such a journal back before it reads, which a connection that may only read cannot do.
"""

import os
import re
import secrets
import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from tracker.errors import DamagedStoreError, SessionError
from tracker.files import check_regular, open_regular, sync_folder
from tracker.session.lock import SessionLock, is_held_here
from tracker.session.store import checksums, integrity

FOLDER = "backups"
"""Folder of the backups, beside the store."""
_N_KEPT = 3
"""Number of backups that stay."""


class Restored(NamedTuple):
    """A store that was replaced by its backup."""

    backup: Path
    kept: Path | None
    """The file that was replaced, under its new name; None if there was none."""


def backups_of(path: Path) -> list[Path]:
    """List the backups of a store, newest first. Backups of older programs, without a counter, are the oldest."""
    backups = (path.parent / FOLDER).glob(f"{path.stem}-*{path.suffix}")
    return sorted(filter(Path.is_file, backups), key=lambda backup: (_counter(backup), backup.name), reverse=True)


def _counter(backup: Path) -> int:
    """Return the number of a backup in the order in which they were made; 0 if its name has none."""
    numbered = re.search(r"-(\d+)-\d{8}T\d+Z$", backup.stem, re.ASCII)
    return 0 if numbered is None else int(numbered[1])


def time_of(backup: Path) -> str:
    """Return the time at which a backup was made, for messages."""
    stamp = backup.stem.rpartition("-")[2]
    with suppress(ValueError):
        return datetime.strptime(stamp, "%Y%m%dT%H%M%S%fZ").strftime("%Y-%m-%d %H:%M:%S UTC")
    return stamp


def back_up(db: sqlite3.Connection, path: Path) -> str | None:
    """Back up an open store that passed its checks, unless its newest backup is equal; delete the oldest ones.

    A failure does not keep anybody from working: it is returned.

    Args:
        db: connection to the store.
        path: of the store.

    Returns:
        Why there is no backup of the store as it is now; None if there is one.
    """
    try:
        if db.execute("SELECT max(id) FROM edits").fetchone() == (None,):
            return None  # nothing to lose
        known = backups_of(path)
        if not (known and _is_copy(known[0], db)):
            number = _counter(known[0]) + 1 if known else 1
            _copy(db, path.parent / FOLDER / f"{path.stem}-{number:06}-{_stamp()}{path.suffix}")
            for old in known[_N_KEPT - 1 :]:
                old.unlink(missing_ok=True)
    except (OSError, sqlite3.Error) as error:
        return f"no backup of {path} was made: {error}; make room, or see that you may write to {path.parent / FOLDER}"
    return None


def copy_store(path: Path, to: Path) -> None:
    """Copy a store to a new file; other programs may have it open.

    Raises:
        OSError, sqlite3.Error: it cannot be read, or the file not be written.
    """
    with closing(_reader(path)) as source:
        _copy(source, to)


def restore(path: Path, backup: Path | None = None) -> Restored:
    """Replace a store by a backup and keep the replaced file. The caller holds the session's lock.

    Args:
        path: of the store, which may be missing or damaged.
        backup: to go back to; by default the newest one that passes its checks.

    Raises:
        SessionError: there is no such backup, or the folder cannot be written.
    """
    chosen = [backup] if backup is not None else backups_of(path)
    problems = []
    for passing in chosen:
        if (problem := _damage(passing)) is None:
            break
        problems.append(f"{passing.name}: {problem}")
    else:
        raise SessionError(
            f"expected a backup of {path} that passes its checks, found {'; '.join(problems) or 'none'}; put a copy of "
            "the file in its place, or move it away to begin without poses"
        )
    try:
        with closing(_reader(passing)) as source:
            fresh = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
            _copy(source, fresh)
        try:
            kept = _set_aside(path)
            fresh.rename(path)
        finally:
            fresh.unlink(missing_ok=True)
        sync_folder(path.parent)
    except (OSError, sqlite3.Error) as error:
        raise SessionError(f"cannot restore {path}: {error}; see that there is room and that you may write") from error
    return Restored(passing, kept)


def _set_aside(path: Path) -> Path | None:
    """Rename a store and its journals, which must not be applied to another file; returns its new path."""
    if not path.exists():
        for ending in JOURNALS:
            path.with_name(path.name + ending).unlink(missing_ok=True)
        return None
    kept = path.with_name(f"{path.stem}-replaced-{_stamp()}{path.suffix}")
    for ending in JOURNALS:  # first: a store without its journal is repaired by hand, a strange journal is not
        beside = path.with_name(path.name + ending)
        if beside.exists():
            beside.rename(kept.with_name(kept.name + ending))
    path.rename(kept)
    return kept


def _damage(backup: Path) -> str | None:
    """Return what is wrong with a backup; None if it passes."""
    if not backup.is_file() or backup.stat().st_size == 0:
        return "there is no such file, or it is empty"
    try:
        with closing(_reader(backup)) as db:
            return integrity.damage(db)
    except (sqlite3.Error, OSError, DamagedStoreError, *integrity.UNDECODABLE) as error:
        return f"{type(error).__name__}: {error}"


def _is_copy(backup: Path, db: sqlite3.Connection) -> bool:
    """Return whether a backup holds the same rows as an open store."""
    try:
        with closing(_reader(backup)) as other:
            return checksums.contents(other) == checksums.contents(db)
    except (sqlite3.Error, OSError, DamagedStoreError, *integrity.UNDECODABLE):  # an older version, or damaged
        return False


def _reader(backup: Path) -> sqlite3.Connection:
    """Open a backup, which stays as it is."""
    check_files(backup)
    return sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro", uri=True)


def _stamp() -> str:
    """Return the present time for the name of a file."""
    return datetime.now(UTC).strftime("%Y%m%dT%H%M%S%f")[:-3] + "Z"


def _copy(source: sqlite3.Connection, to: Path) -> None:
    """Copy an open store to a new file, which appears complete or not at all."""
    to.parent.mkdir(exist_ok=True)
    for unfinished in to.parent.glob(".*-*.backup.tmp"):
        unfinished.unlink(missing_ok=True)
    temporary = to.with_name(f".{to.stem}-{secrets.token_hex(4)}.backup.tmp")
    try:
        with closing(sqlite3.connect(temporary)) as db:
            db.execute("PRAGMA journal_mode = OFF")  # it is deleted if it does not become complete
            db.execute("PRAGMA synchronous = OFF")
            source.backup(db)
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.rename(to)
        sync_folder(to.parent)
    finally:
        temporary.unlink(missing_ok=True)


JOURNALS = ("-journal", "-wal", "-shm")
"""Endings of the files that SQLite may leave beside a store after a crash; they belong to that very file."""
_NEEDS_ROLLBACK = (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN)
"""Primary codes of errors by which SQLite says that it would have to write before it can read."""
_ATTEMPTS = 5
"""Copies of a store that another program is writing meanwhile, before the last error is raised."""
_MAGIC = bytes.fromhex("d9d505f920a163d7")
"""The last bytes of a journal that names another file, which SQLite would delete (SQLite's file format, 3)."""

Connect = Callable[[Path, str], sqlite3.Connection]
"""Opens a file of SQLite; the second argument is `ro` or `rw`."""


def open_reader(path: Path, connect: Connect) -> sqlite3.Connection:
    """Open a store that is only read, as the last commit left it.

    The journal is rolled back under the session's lock. If the folder cannot be written, or another program holds
    the lock, a copy is rolled back, which is gone when the connection is closed.

    Args:
        path: of the store.
        connect: opens it.

    Raises:
        sqlite3.Error: it cannot be read.
        OSError: it cannot be copied.
    """
    error: sqlite3.Error | None = None
    for _ in range(_ATTEMPTS):
        db = connect(path, "ro")
        try:
            db.execute("PRAGMA schema_version").fetchone()  # which needs a file that is whole
            return db
        except sqlite3.Error as found:
            db.close()
            if integrity.primary_code(found) not in _NEEDS_ROLLBACK:
                raise
            error = found
        if not _roll_back_in_place(path, connect):
            copied = _open_copy(path, connect)
            if copied is not None:
                return copied
    assert error is not None
    raise error


def check_files(path: Path) -> None:
    """Check the files of a store before SQLite opens them.

    Raises:
        DamagedStoreError: a journal names another file, which SQLite would delete.
        OSError: one is a pipe or a device, or cannot be read.
    """
    check_regular(path, *(path.with_name(path.name + ending) for ending in JOURNALS))
    journal = path.with_name(f"{path.name}-journal")
    try:
        with open_regular(journal) as file:
            file.seek(-min(len(_MAGIC), os.fstat(file.fileno()).st_size), os.SEEK_END)
            is_foreign = file.read() == _MAGIC
    except FileNotFoundError:
        return
    if is_foreign:
        raise DamagedStoreError(
            f"annotations {path} are damaged: expected a journal of this file alone, found {journal.name}, which "
            "leads to another file; delete the journal"
        )


def _roll_back_in_place(path: Path, connect: Connect) -> bool:
    """Roll back the journal of a store under the session's lock; False if it cannot be held or the folder not written.

    Connections that may write do so before their first query.
    """
    if is_held_here(path.parent):
        return _rolled_back(path, connect)
    try:
        with SessionLock(path.parent):
            return _rolled_back(path, connect)
    except SessionError:
        return False


def _rolled_back(path: Path, connect: Connect) -> bool:
    try:
        with closing(connect(path, "rw")) as db:
            db.execute("PRAGMA schema_version").fetchone()
    except sqlite3.Error as error:
        if integrity.primary_code(error) in _NEEDS_ROLLBACK:
            return False  # the folder cannot be written
        raise
    return True


def _open_copy(path: Path, connect: Connect) -> sqlite3.Connection | None:
    """Open a copy of a store and its journals, rolled back; None if they changed while they were copied."""
    files = [file for ending in ("", *JOURNALS) if (file := path.with_name(path.name + ending)).exists()]
    with tempfile.TemporaryDirectory(prefix="quadrille-", ignore_cleanup_errors=True) as folder:
        before = _versions(files)
        for file in files:
            shutil.copyfile(file, Path(folder) / file.name)
        if _versions(files) != before:
            return None
        copy = Path(folder) / path.name
        with closing(connect(copy, "rw")) as db:
            db.execute("PRAGMA schema_version").fetchone()
        db = connect(copy, "ro")
        try:
            db.execute("PRAGMA schema_version").fetchone()  # opens the file, whose name may then go
        except BaseException:
            db.close()
            raise
        return db


def _versions(files: list[Path]) -> list[tuple[int, int, int]]:
    return [(status.st_ino, status.st_size, status.st_mtime_ns) for status in map(os.stat, files)]
