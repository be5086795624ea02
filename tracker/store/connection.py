"""The SQLite file of a store: opening, upgrading, transactions, queries."""

import sqlite3
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tracker.errors import SessionError
from tracker.store import schema


class Connection:
    """A connection to the file of a store. Safe to use from several threads."""

    def __init__(self, path: str | Path, read_only: bool = False) -> None:
        """Open the file. Unless read only, create a missing one and upgrade an older one.

        Raises:
            SessionError: the file is missing, not a store, or newer than this program.
        """
        self._path = Path(path)
        self._lock = threading.RLock()
        if read_only and not self._path.is_file():
            raise SessionError(f"annotations {path} not found; check the session folder")
        mode = "ro" if read_only else "rwc"
        with self._errors():
            self.db = sqlite3.connect(
                f"{self._path.absolute().as_uri()}?mode={mode}",
                uri=True,
                isolation_level=None,  # transactions are explicit
                check_same_thread=False,
                timeout=10.0,
            )
            # No write-ahead log: it needs shared memory, which network drives lack. EXTRA syncs the folder's entry
            # besides what FULL syncs; without it a power cut could restore the journal and lose the last commit.
            self.db.execute("PRAGMA journal_mode = DELETE")
            self.db.execute("PRAGMA synchronous = EXTRA")
            self.db.execute("PRAGMA foreign_keys = ON")
            version = self._prepare(read_only)
        if version != schema.VERSION:
            self.db.close()
            what = "is not a store of annotations" if version == 0 else f"has version {version}"
            raise SessionError(
                f"annotations {path} {what}, this program reads up to version {schema.VERSION}; upgrade quadrille"
            )

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
            self.db.execute("BEGIN IMMEDIATE")
            try:
                yield self.db
                self.db.execute("COMMIT")
            except BaseException:
                if self.db.in_transaction:  # a full disk may have ended it already
                    self.db.execute("ROLLBACK")
                raise

    def one(self, sql: str, parameters: Sequence[Any]) -> Any:
        """Return the first row of a query, or None."""
        with self._lock, self._errors():
            return self.db.execute(sql, parameters).fetchone()

    def all(self, sql: str, parameters: Sequence[Any]) -> list[Any]:
        """Return all rows of a query."""
        with self._lock, self._errors():
            return self.db.execute(sql, parameters).fetchall()

    def _prepare(self, read_only: bool) -> int:
        """Create or upgrade the tables and return the version that the store then has.

        An older store that is opened read only stays unchanged on the disk and is read as one of today's version.
        """
        if read_only:
            return schema.show_as_new(self.db)
        version = schema.version(self.db)
        if version < schema.VERSION:
            with self.transaction() as db:  # all or nothing: a power cut leaves the older file
                version = schema.upgrade(db)
        return version

    @contextmanager
    def _errors(self) -> Generator[None, None, None]:
        try:
            yield
        except sqlite3.Error as error:
            raise SessionError(
                f"annotations {self._path} cannot be read or written: {error}; check the disk and who has the file open"
            ) from error
