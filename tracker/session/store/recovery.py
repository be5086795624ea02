"""Open a store for reading although a crash in the middle of a commit has left its journal.

SQLite rolls such a journal back before it reads, which a connection that may only read cannot do.
"""

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from tracker.errors import DamagedStoreError, SessionError
from tracker.files import check_regular, open_regular
from tracker.session.lock import SessionLock, is_held_here
from tracker.session.store import verification

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
            if verification.primary_code(found) not in _NEEDS_ROLLBACK:
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
        if verification.primary_code(error) in _NEEDS_ROLLBACK:
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
