"""Checksums of a store, which show damage that SQLite accepts: other numbers in a pose, rows that are missing.

Every row holds the checksum of its columns, and `contents` the number of rows of each table and the sum of their
checksums. Temporary triggers of each connection that writes keep both up to date, so no statement can forget them.
"""

import sqlite3
from zlib import crc32

COLUMNS = {
    "edits": "id, parent, label, author, time, program, uid",
    "head": "edit",
    "moves": "id, kind, edit, time",
    "model_revisions": "id, person, toml, time",
    "program_settings": "id, settings",
    "pose_changes": "id, edit, previous, person, frame, numbers, sources, keyframe, status, cost_px, model_revision, "
    "settings, views_px, parts_px, remark, program_settings, reviewed, limbs, errors, made_in, "
    "trace",
    "poses": "person, frame, change",
    "alternatives": "change, rank, model_revision, numbers, cost_px",
    "pin_changes": "id, edit, previous, person, frame, point, camera, u, v",
    "pins": "person, frame, point, camera, change",
    "settings": "key, value",
    "tasks": "uid, kind, person, frame, annotator, author, time",
    "task_states": "uid, task, state, comment, author, time, pose",
    "comments": "uid, about, person, frame, limb, text, resolved, author, time",
}
"""Columns of each table that its checksums cover."""
_NO_UID: dict[str, tuple[str, ...]] = {"edits": ("uid",)}
LATER_COLUMNS: dict[int, dict[str, tuple[str, ...]]] = {
    6: {"pose_changes": ("limbs", "errors", "made_in", "trace"), **_NO_UID},
    7: {"pose_changes": ("errors", "made_in", "trace"), **_NO_UID},
    8: {"pose_changes": ("made_in", "trace"), **_NO_UID},
    9: _NO_UID,
    10: {"task_states": ("pose",)},
}
"""Columns that the tables of each older version with checksums lack."""
LATER_TABLES = ("tasks", "task_states", "comments")
"""Tables that the oldest versions lack."""
TABLES_SINCE = next(version for version, later in LATER_COLUMNS.items() if "edits" not in later)
"""The first version with `LATER_TABLES`, in which edits got their identities, too."""
OLDEST_VERSION = min(LATER_COLUMNS)
"""The first version of a store with checksums."""
_KEYS = {
    "poses": "person, frame",
    "alternatives": "change, rank",
    "pins": "person, frame, point, camera",
    "settings": "key",
    **dict.fromkeys(LATER_TABLES, "uid"),
}
"""Primary keys of the tables without row numbers."""
_SCHEMA = "sqlite_master"
_SCHEMA_COLUMNS = "type, name, tbl_name, sql"
_LISTED = 3
"""Number of damaged rows that a message names."""

ADDED = (
    *(f"ALTER TABLE {table} ADD COLUMN checksum INTEGER" for table in COLUMNS if table not in LATER_TABLES),
    "CREATE TABLE contents (name TEXT PRIMARY KEY, n_rows INTEGER NOT NULL, total INTEGER NOT NULL) WITHOUT ROWID",
)
"""Statements that add the checksums to the tables of a store; `fill_in` computes them."""

Contents = tuple[tuple[str, int, int], ...]
"""For each table its name, number of rows and sum of checksums."""


def register(db: sqlite3.Connection) -> None:
    """Make `row_checksum` known to a connection."""
    db.create_function("row_checksum", -1, _row_checksum, deterministic=True)


def watch(db: sqlite3.Connection) -> None:
    """Keep the checksums up to date with all that a connection writes."""
    # The triggers call a function of the program, which some builds of SQLite refuse by default.
    db.execute("PRAGMA trusted_schema = ON")
    db.execute("PRAGMA recursive_triggers = ON")  # REPLACE deletes rows too
    for table, columns in COLUMNS.items():
        key = _KEYS.get(table, "rowid")
        where = "WHERE " + " AND ".join(f"{column} = NEW.{column}" for column in key.split(", "))
        added = (
            f"UPDATE {table} SET checksum = row_checksum({columns}) {where}; "
            f"UPDATE contents SET n_rows = n_rows + 1, total = total + (SELECT checksum FROM {table} {where}) "
            f"WHERE name = '{table}'; "
        )
        removed = f"UPDATE contents SET n_rows = n_rows - 1, total = total - OLD.checksum WHERE name = '{table}'; "
        for event, body in (("INSERT", added), ("DELETE", removed), (f"UPDATE OF {columns}", removed + added)):
            name = f"{table}_{event.split()[0].lower()}"
            db.execute(f"CREATE TEMP TRIGGER {name} AFTER {event} ON main.{table} BEGIN {body}END")


def fill_in(db: sqlite3.Connection) -> None:
    """Compute all checksums of a store that has none, within a transaction."""
    db.execute("DELETE FROM contents")
    for table, columns in COLUMNS.items():
        db.execute(f"UPDATE {table} SET checksum = row_checksum({columns})")
        db.execute(f"INSERT INTO contents VALUES ('{table}', {_counted(table)})")
    db.execute(f"INSERT INTO contents VALUES ('{_SCHEMA}', {_counted_schema()})")


def contents(db: sqlite3.Connection) -> Contents:
    """Return what the store says of its tables: equal for stores with equal rows."""
    return tuple(db.execute("SELECT name, n_rows, total FROM contents ORDER BY name").fetchall())


def differences(db: sqlite3.Connection, version: int) -> list[str]:
    """Describe where a store differs from what was written into it; empty if nowhere.

    Args:
        db: connection to it.
        version: of the store, `OLDEST_VERSION` or later.

    Raises:
        sqlite3.Error: tables or columns are missing, or the file cannot be read.
    """
    damaged = []
    known = {name: (n, total) for name, n, total in contents(db)}
    tables = [table for table in COLUMNS if version >= TABLES_SINCE or table not in LATER_TABLES]
    if set(known) != {*tables, _SCHEMA}:
        damaged.append("the list of its tables is not as it was written")
    for table in tables:
        all_columns = COLUMNS[table]
        later = LATER_COLUMNS.get(version, {}).get(table, ())
        columns = ", ".join(c for c in all_columns.split(", ") if c not in later)
        wrong = db.execute(
            f"SELECT {_label(table)} FROM {table} WHERE checksum IS NOT row_checksum({columns})"
        ).fetchall()
        if wrong:
            listed = "; ".join(str(label) for (label,) in wrong[:_LISTED])
            more = f" and {len(wrong) - _LISTED} more" if len(wrong) > _LISTED else ""
            damaged.append(f"rows of '{table}' are not as they were written ({listed}{more})")
            continue
        counted = tuple(db.execute(f"SELECT {_counted(table)}").fetchone())
        if table in known and counted != known[table]:
            damaged.append(f"expected {known[table][0]} rows of '{table}' as they were written, found {counted[0]}")
    if tuple(db.execute(f"SELECT {_counted_schema()}").fetchone()) != known.get(_SCHEMA):
        damaged.append("the definitions of its tables are not as they were written")
    return damaged


def _counted(table: str) -> str:
    """SQL for the number of rows of a table and the sum of their checksums."""
    return f"(SELECT count(*) FROM {table}), (SELECT coalesce(sum(checksum), 0) FROM {table})"


def _counted_schema() -> str:
    """SQL for the number of definitions of the store's own tables and indices, and the sum of their checksums."""
    tables = ", ".join(f"'{table}'" for table in (*COLUMNS, "contents"))
    rows = f"FROM {_SCHEMA} WHERE tbl_name IN ({tables})"
    return f"(SELECT count(*) {rows}), (SELECT sum(row_checksum({_SCHEMA_COLUMNS})) {rows})"


def _label(table: str) -> str:
    """SQL for the name of a row in a message."""
    columns = COLUMNS[table].split(", ")
    if "frame" in columns:
        return "coalesce(person, '?') || ', frame ' || coalesce(frame, '?')"
    return f"coalesce({columns[0]}, '?')"


def _row_checksum(*values: object) -> int:
    # `ascii` writes numbers, text and bytes the same in all versions of Python; `repr` does not for newer letters.
    return crc32(ascii(values).encode("ascii"))
