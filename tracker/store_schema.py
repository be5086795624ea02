"""The tables of the store of annotations, and how a store of an older version becomes one of today's.

Upgrading adds columns and never rewrites a row: the log of edits is what undo stands on.
"""

import sqlite3

VERSION = 2

_SCHEMA = """
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL
);
CREATE INDEX edits_parent ON edits (parent);
-- One row; NULL: nothing is done.
CREATE TABLE head (edit INTEGER REFERENCES edits);
INSERT INTO head VALUES (NULL);
CREATE TABLE moves (                                             -- undo and redo, as they happened
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    kind TEXT NOT NULL, edit INTEGER NOT NULL REFERENCES edits, time TEXT NOT NULL
);
CREATE TABLE model_revisions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, person TEXT NOT NULL, toml TEXT NOT NULL, time TEXT NOT NULL
);
CREATE TABLE pose_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pose_changes,                    -- what the frame showed before; NULL: nothing
    person TEXT NOT NULL, frame INTEGER NOT NULL,
    numbers BLOB,                                                -- little-endian float64; NULL: cleared
    sources BLOB, keyframe INTEGER, status TEXT, cost_px REAL,
    model_revision INTEGER REFERENCES model_revisions, settings TEXT,
    views_px BLOB, parts_px BLOB,                                -- little-endian float64, NaN: unknown; NULL: none
    remark TEXT
);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
CREATE TABLE pin_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pin_changes,
    person TEXT NOT NULL, frame INTEGER NOT NULL, point TEXT NOT NULL, camera TEXT NOT NULL,
    u REAL, v REAL                                               -- original pixels; NULL: cleared
);
CREATE INDEX pin_changes_edit ON pin_changes (edit);
CREATE TABLE pins (
    person TEXT, frame INTEGER, point TEXT, camera TEXT, change INTEGER NOT NULL REFERENCES pin_changes,
    PRIMARY KEY (person, frame, point, camera)
) WITHOUT ROWID;
CREATE TABLE settings (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
"""

# Statements that bring a store of each older version to the next.
_UPGRADES = {
    1: (
        "ALTER TABLE pose_changes ADD COLUMN views_px BLOB",
        "ALTER TABLE pose_changes ADD COLUMN parts_px BLOB",
        "ALTER TABLE pose_changes ADD COLUMN remark TEXT",
    ),
}
# What a store of each older version is read through where it must not be written. A temporary view stands in front
# of the table of its name.
_VIEWS = {
    1: "CREATE TEMP VIEW pose_changes AS "
    "SELECT *, NULL AS views_px, NULL AS parts_px, NULL AS remark FROM main.pose_changes",
}


def version(db: sqlite3.Connection) -> int:
    """Version of a store; 0 for an empty file."""
    return int(db.execute("PRAGMA user_version").fetchone()[0])


def upgrade(db: sqlite3.Connection) -> int:
    """Make the tables of a new store, or those that an older one lacks, within a transaction of the caller.

    Returns:
        The version that the store then has: another program may have been faster, and newer.
    """
    found = version(db)
    if found > VERSION:
        return found
    statements = _SCHEMA.split(";\n") if found == 0 else [s for v in range(found, VERSION) for s in _UPGRADES[v]]
    for statement in statements:
        db.execute(statement)
    db.execute(f"PRAGMA user_version = {VERSION}")
    return VERSION


def show_as_new(db: sqlite3.Connection) -> int:
    """Let a store of an older version be read like one of today's, its file untouched; returns what it reads as."""
    found = version(db)
    if found not in _VIEWS:
        return found
    db.execute(_VIEWS[found])
    return VERSION
