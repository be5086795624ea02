"""Check a store when it is opened: sound for SQLite, and as it was written. Bound the steps of queries.

Odd rows cannot keep the program busy for ever, and signals end a query.
"""

import re
import sqlite3
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import cache

from tracker.session.store import checksums, rows, schema

_TICK_STEPS = 10_000
"""Steps of SQLite's virtual machine between two looks at the limit: less than a millisecond."""
_FREE_STEPS = 20_000_000
"""Steps that any query may take: about a second."""
_STEPS_PER_BYTE = 50
"""Steps that a query may take for each byte of the file. Queries of the program visit each row a few times."""


class EndlessQueryError(Exception):
    """A query took more steps than the rows of the store can need."""


@contextmanager
def limited(db: sqlite3.Connection, n_bytes: Callable[[], int]) -> Generator[None, None, None]:
    """Limit the steps of the queries within a `with` block, together.

    Args:
        db: connection that runs them.
        n_bytes: returns the size of the store; called once if they take long.

    Raises:
        EndlessQueryError: they took too many steps.
        BaseException: that a signal raised meanwhile, which SQLite would hide.
    """
    n_ticks, raised = 0, list[BaseException]()

    def tick() -> int:
        nonlocal n_ticks
        try:
            n_ticks += 1
            n_steps = n_ticks * _TICK_STEPS
            return int(n_steps > _FREE_STEPS and n_steps > _FREE_STEPS + _STEPS_PER_BYTE * n_bytes())
        except BaseException as error:
            raised.append(error)
            return 1

    db.set_progress_handler(tick, _TICK_STEPS)
    try:
        yield
    except sqlite3.OperationalError as error:
        if raised:
            raise raised[0] from error
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
            raise EndlessQueryError("a query took more steps than its rows can need") from error
        raise
    finally:
        db.set_progress_handler(None, 0)


_BROKEN = (
    sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR, sqlite3.SQLITE_MISMATCH, sqlite3.SQLITE_TOOBIG,
)  # fmt: skip
"""Primary codes of errors that show damage while a store is checked; other errors concern the disk or its users."""

UNDECODABLE = (UnicodeDecodeError, OverflowError, MemoryError)
"""Errors that Python raises instead of those of SQLite if names, texts or lengths in a damaged file are nonsense."""


def damage(db: sqlite3.Connection) -> str | None:
    """Return what is wrong with a store of this version or an older one; None if it passes.

    Args:
        db: connection to it, without a transaction.

    Raises:
        sqlite3.Error: it cannot be read, for example because of its disk or its rights.
    """
    checksums.register(db)
    try:
        db.execute("BEGIN")  # one state: another program may write meanwhile
        try:
            n_bytes = _size(db)
            with limited(db, lambda: n_bytes):
                return _damage(db)
        finally:
            db.rollback()
    except EndlessQueryError as error:
        return str(error)
    except UNDECODABLE as error:
        return f"its definitions or rows cannot be decoded ({type(error).__name__})"
    except sqlite3.Error as error:
        if primary_code(error) in _BROKEN:
            return f"SQLite reports: {error}"
        raise


def primary_code(error: sqlite3.Error) -> int:
    """Return the primary result code of an error; `SQLITE_ERROR` if it has none."""
    return getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF


def _size(db: sqlite3.Connection) -> int:
    (n_pages,), (page_bytes,) = (db.execute(f"PRAGMA {name}").fetchone() for name in ("page_count", "page_size"))
    return int(n_pages * page_bytes)


def _damage(db: sqlite3.Connection) -> str | None:
    version = schema.version(db)
    # Before all else: checks of SQLite run expressions of foreign definitions.
    if version <= schema.VERSION and (foreign := foreign_definition(db)) is not None:
        return foreign
    problems = [text for (text,) in db.execute("PRAGMA integrity_check(3)")]
    if problems != ["ok"]:
        return f"SQLite reports: {'; '.join(str(p).strip() for p in problems)}"
    if version > schema.VERSION:
        return None  # a newer program knows
    if version >= checksums.OLDEST_VERSION:
        return "; ".join(checksums.differences(db, version)) or _out_of_order(db)
    if db.execute("SELECT count(*) FROM sqlite_master WHERE name = 'contents'").fetchone() != (0,):
        return f"expected version {schema.VERSION}, found {version}"
    if version == 0:
        return "expected tables of annotations, found a file without a version"
    return _unreadable(db) or _out_of_order(db)


def _out_of_order(db: sqlite3.Connection) -> str | None:
    """Return a change or edit that does not follow an earlier one: such a chain might have no end."""
    for table, column in (("edits", "parent"), ("pose_changes", "previous"), ("pin_changes", "previous")):
        row = db.execute(f"SELECT id FROM {table} WHERE {column} >= id LIMIT 1").fetchone()
        if row is not None:
            return f"row {row[0]} of '{table}' follows a later one"
    return None


def _unreadable(db: sqlite3.Connection) -> str | None:
    """Return why a store without checksums cannot be read; None if all of its rows can."""
    revisions = {revision for (revision,) in db.execute("SELECT id FROM model_revisions")}
    columns = "person, frame, numbers, sources, model_revision"
    for person, frame, numbers, sources, revision in db.execute(f"SELECT {columns} FROM pose_changes"):
        if not rows.is_readable(numbers, sources) or (numbers is not None and revision not in revisions):
            return f"the pose of {person!r} in frame {frame} cannot be read"
    return None


_WORD = re.compile(r'"(\w+)"|--[^\n]*|(\w+)|(\S)')
"""A quoted or bare word, a comment, or another character."""
_BY_SQLITE = {"CREATE TABLE sqlite_sequence(name,seq)"}
"""Definitions that SQLite adds by itself; those of primary keys have no text."""


def foreign_definition(db: sqlite3.Connection) -> str | None:
    """Return what a store of this version or an older one defines that no version of the program does; None if nothing.

    It is checked before anything else is asked of the store. A trigger or view of somebody else would run with the
    program's own statements: it could delete poses behind an edit that is shown as saved, or never end.

    Raises:
        sqlite3.Error: the definitions cannot be read.
    """
    allowed, names = _own_words()
    for kind, name, text in db.execute("SELECT type, name, sql FROM sqlite_master"):
        is_own_table = kind == "table" and name in names and _words(str(text)) <= allowed
        is_of_key = kind == "index" and text is None and str(name).startswith("sqlite_autoindex_")
        if not (is_own_table or is_of_key or text in _BY_SQLITE or (kind, text) in _OWN_INDICES):
            return f"its definitions are not as they were written: the {kind!s:.20} {name!r:.60} is none of the program"
    return None


def _words(text: str) -> set[str]:
    """Return the words and other characters of a definition, without comments, in capitals."""
    words = {(quoted or bare or other).upper() for quoted, bare, other in _WORD.findall(text)}
    return words - {""}


@cache
def _own_words() -> tuple[set[str], set[str]]:
    """Return the words that definitions of the program consist of, and the names of its tables."""
    text = "; ".join(schema.STATEMENTS)
    named = re.findall(r"(?:CREATE TABLE|RENAME TO) (\w+)", text)
    return _words(text), set(named)


_OWN_INDICES = {("index", text) for text in schema.STATEMENTS if text.startswith("CREATE INDEX")}
