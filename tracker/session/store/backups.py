"""Backups of a store: the last few that passed their checks at opening, and going back to one of them.

Their names hold a counter, because a clock may have been ahead, and the time, for people.
"""

import os
import re
import secrets
import sqlite3
from contextlib import closing, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from tracker.errors import DamagedStoreError, SessionError
from tracker.files import sync_folder
from tracker.session.store import checksums, verification
from tracker.session.store.recovery import JOURNALS, check_files

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
            return verification.damage(db)
    except (sqlite3.Error, OSError, DamagedStoreError, *verification.UNDECODABLE) as error:
        return f"{type(error).__name__}: {error}"


def _is_copy(backup: Path, db: sqlite3.Connection) -> bool:
    """Return whether a backup holds the same rows as an open store."""
    try:
        with closing(_reader(backup)) as other:
            return checksums.contents(other) == checksums.contents(db)
    except (sqlite3.Error, OSError, DamagedStoreError, *verification.UNDECODABLE):  # an older version, or damaged
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
