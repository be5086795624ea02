"""The SQLite file of a store: opening with all checks, upgrading, transactions, queries."""

import os
import secrets
import sqlite3
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, TypeVar

from tracker.errors import DamagedStoreError, SessionError
from tracker.files import IrregularFileError, refuse_links, sync_folder
from tracker.session.store import backups, checksums, integrity, records, schema
from tracker.session.store.integrity import EndlessQueryError, limited

T = TypeVar("T")

_OF_THE_FILE = (sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY)
"""Primary codes of errors after which the file is opened again: its drive or folder may have gone away."""
_TIMEOUT_S = 10.0
"""Time to wait for other programs that have locked the file."""


class Connection:
    """A connection to the file of a store. Safe to use from several threads.

    If the session's folder goes away and comes back, the file is opened again, and must have the same content.
    """

    def __init__(self, path: str | Path, read_only: bool = False) -> None:
        """Open the file. Unless read only, create a missing one, back it up if it has changed, upgrade an older one.

        Raises:
            SessionError: the file is missing, not a store, or newer than this program.
            DamagedStoreError: the file is not as it was written.
        """
        self._path, self._read_only = Path(path), read_only
        self._lock = threading.RLock()
        self._is_suspect = False  # whether the file is opened again before it is written
        self.backup_error: str | None = None
        """Why there is no backup of the store as it was opened; None if there is one."""
        with self._errors():
            if not read_only:
                name = self._path.name
                refuse_links(self._path.parent, name, *(name + ending for ending in backups.JOURNALS), "backups")
                if not self._path.exists():
                    if backups.backups_of(self._path):
                        raise self.damaged("expected the poses of the session, found no such file")
                    _create(self._path)
            self.db = self._open()
            try:
                if not read_only:
                    self.backup_error = backups.back_up(self.db, self._path)
                self._prepare()
            except BaseException:
                self.db.close()
                raise
            self._note()

    def close(self) -> None:
        """Release the file."""
        with self._lock:
            self.db.close()

    @contextmanager
    def transaction(self) -> Generator[sqlite3.Connection, None, None]:
        """Hold the lock and write all or nothing. When it ends, the changes are on the disk.

        Raises:
            SessionError: the file cannot be read or written.
        """
        with self._lock, self._errors():
            self._reopen_moved(for_writing=True)
            with _all_or_nothing(self.db):
                yield self.db
                contents = checksums.contents(self.db)
            self._contents = contents

    @contextmanager
    def snapshot(self) -> Generator[None, None, None]:
        """Read one state of the file within a `with` block, although other programs write."""
        with self._lock, self._errors():
            self._reopen_moved(for_writing=False)
            self.db.execute("BEGIN")
            try:
                yield
            finally:
                self.db.rollback()

    @contextmanager
    def impatient(self) -> Generator[None, None, None]:
        """Raise at once where other programs have locked the file, within a `with` block."""
        with self._lock:
            self.db.execute("PRAGMA busy_timeout = 0")
            try:
                yield
            finally:
                self.db.execute(f"PRAGMA busy_timeout = {_TIMEOUT_S * 1000:.0f}")

    def one(self, sql: str, parameters: Sequence[Any], convert: Callable[[Any], T]) -> T | None:
        """Return the first row of a query, converted; None if there is none."""

        def query() -> T | None:
            row = self.db.execute(sql, parameters).fetchone()
            return None if row is None else convert(row)

        return self._read(query)

    def all(self, sql: str, parameters: Sequence[Any], convert: Callable[[Any], T]) -> list[T]:
        """Return all rows of a query, converted.

        Raises:
            DamagedStoreError: a row is not one that the program writes, as `convert` finds, or the query has no end.
            SessionError: the file cannot be read.
        """
        return self._read(lambda: [convert(row) for row in self.db.execute(sql, parameters).fetchall()])

    def _read(self, query: Callable[[], T]) -> T:
        with self._lock, self._errors():
            self._reopen_moved(for_writing=False)
            with limited(self.db, lambda: self._path.stat().st_size):
                return query()

    def _open(self) -> sqlite3.Connection:
        """Open the file and check it.

        Raises:
            SessionError: as for the constructor.
            sqlite3.Error: it cannot be read.
            OSError: it cannot be read.
        """
        backups.check_files(self._path)
        if not self._path.is_file():
            raise SessionError(f"annotations {self._path} not found; check the session folder")
        if self._path.stat().st_size == 0:
            raise self.damaged("expected the poses of the session, found an empty file of 0 bytes")
        db = backups.open_reader(self._path, _connect) if self._read_only else _connect(self._path, "rw")
        try:
            damage = integrity.damage(db)
            if damage is not None:
                raise self.damaged(damage)
            version = schema.version(db)
            if version > schema.VERSION:
                raise SessionError(
                    f"annotations {self._path} have version {version}, this program reads up to version "
                    f"{schema.VERSION}; upgrade quadrille"
                )
        except BaseException:
            db.close()
            raise
        return db

    def _prepare(self) -> None:
        """Upgrade an older store, and keep its checksums up to date from now on.

        An older store that is opened read only stays unchanged on the disk and is read as one of today's version.
        """
        if self._read_only:
            schema.show_as_new(self.db)
            return
        if schema.version(self.db) < schema.VERSION:
            with _all_or_nothing(self.db):  # a power cut leaves the older file
                schema.upgrade(self.db)
        checksums.watch(self.db)

    def _note(self) -> None:
        """Remember which file is open and what it holds."""
        if not self._read_only:
            self._file, self._contents = _identity(self._path), checksums.contents(self.db)

    def _reopen_moved(self, for_writing: bool) -> None:
        """Open the file again if there is another one in its place, as after its drive was away.

        Raises:
            SessionError: it is to be written and is not there, or has other content than the one that was open.
        """
        if self._read_only:
            return
        try:
            is_other = _identity(self._path) != self._file
        except OSError as error:
            if not for_writing:
                return  # what is open can be read for as long as the system lets it
            raise SessionError(
                f"annotations {self._path} are not there ({error.strerror}); bring the session's folder back"
            ) from error
        if not is_other and not (self._is_suspect and for_writing):
            return
        db = self._open()
        if checksums.contents(db) != self._contents:
            db.close()
            if not for_writing:
                return
            raise SessionError(
                f"annotations {self._path} are others than those that were opened; put the session's folder back as it "
                "was, or open the session again"
            )
        self.db.close()
        self.db = db
        checksums.watch(db)
        self._note()
        self._is_suspect = False

    def damaged(self, found: str) -> DamagedStoreError:
        """Return the error that names what is wrong with the store, and the backup to go back to."""
        known = backups.backups_of(self._path)
        advice = (
            f"run 'quadrille restore {self._path.parent}' to go back to the backup of {backups.time_of(known[0])}, "
            "which keeps the damaged file"
            if known
            else "put a copy of the file in its place, or move it away to begin without poses"
        )
        return DamagedStoreError(f"annotations {self._path} are damaged: {found}; {advice}")

    @contextmanager
    def _errors(self) -> Generator[None, None, None]:
        try:
            yield
        except DamagedStoreError as error:
            if str(self._path) in str(error):
                raise
            raise self.damaged(str(error).removesuffix("; correct it")) from error
        except EndlessQueryError as error:
            raise self.damaged(str(error)) from error
        except sqlite3.Error as error:
            code = integrity.primary_code(error)
            if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
                raise self.damaged(f"SQLite reports: {error}") from error
            self._is_suspect |= code in _OF_THE_FILE
            raise SessionError(
                f"annotations {self._path} cannot be read or written: {error}; check the disk and who has the file open"
            ) from error
        except integrity.UNDECODABLE as error:
            raise self.damaged(f"its definitions or rows cannot be decoded ({type(error).__name__})") from error
        except IrregularFileError as error:
            raise self.damaged(f"{error.strerror} at {error.filename}") from error
        except OSError as error:
            raise SessionError(
                f"annotations {self._path} cannot be read or written: {error.strerror}; check the disk and your rights"
            ) from error


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a file of SQLite; `mode` is `ro`, `rw` or `rwc`."""
    db = sqlite3.connect(
        f"{path.absolute().as_uri()}?mode={mode}",
        uri=True,
        isolation_level=None,  # transactions are explicit
        check_same_thread=False,
        timeout=_TIMEOUT_S,
    )
    try:
        if mode != "ro":
            # No write-ahead log: it needs shared memory, which network drives lack. EXTRA syncs the folder's entry
            # besides what FULL syncs; without it a power cut could restore the journal and lose the last commit.
            db.execute("PRAGMA journal_mode = DELETE")
            db.execute("PRAGMA synchronous = EXTRA")
        db.execute("PRAGMA foreign_keys = ON")
        checksums.register(db)
        records.register(db)
    except BaseException:
        db.close()
        raise
    return db


@contextmanager
def _all_or_nothing(db: sqlite3.Connection) -> Generator[None, None, None]:
    """Commit what is written within a `with` block, or roll it back where that raises."""
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:  # a full disk may have ended it already
            db.execute("ROLLBACK")
        raise


def _create(path: Path) -> None:
    """Write an empty store. It appears complete: an empty file in its place was not left by a crash."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        with closing(_connect(temporary, "rwc")) as db, _all_or_nothing(db):
            schema.create(db)
        temporary.rename(path)
        sync_folder(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _identity(path: Path) -> tuple[int, int]:
    """Return the device and number of a file."""
    status = os.stat(path)
    return status.st_dev, status.st_ino
