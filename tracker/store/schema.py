"""The tables of the store of annotations, and the upgrade of older versions.

An upgrade adds tables and columns and never rewrites a row, because undo depends on the log of edits.
"""

import sqlite3

VERSION = 5

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
CREATE TABLE told (                                              -- settings of programs, shared by poses
    id INTEGER PRIMARY KEY, settings TEXT NOT NULL UNIQUE
);
CREATE TABLE pose_changes (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    edit INTEGER NOT NULL REFERENCES edits,
    previous INTEGER REFERENCES pose_changes,                    -- what the frame showed before; NULL: nothing
    person TEXT NOT NULL, frame INTEGER NOT NULL,
    numbers BLOB,                                                -- little-endian float64; NULL: cleared
    sources BLOB, keyframe INTEGER, status TEXT, cost_px REAL,
    model_revision INTEGER REFERENCES model_revisions,
    settings TEXT,                                               -- of versions 1 and 2; NULL since: see told
    views_px BLOB, parts_px BLOB,                                -- little-endian float64, NaN: unknown; NULL: none
    remark TEXT,
    told INTEGER REFERENCES told,
    reviewed INTEGER                                             -- NULL: written before version 4, not reviewed
);
CREATE INDEX pose_changes_edit ON pose_changes (edit);
CREATE TABLE poses (
    person TEXT, frame INTEGER, change INTEGER NOT NULL REFERENCES pose_changes, PRIMARY KEY (person, frame)
) WITHOUT ROWID;
CREATE TABLE alternatives (                                      -- poses about as good as that of a change
    change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL,
    model_revision INTEGER NOT NULL REFERENCES model_revisions,
    numbers BLOB NOT NULL,                                       -- little-endian float64
    cost_px REAL, PRIMARY KEY (change, rank)
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

_UPGRADES = {
    1: (
        "ALTER TABLE pose_changes ADD COLUMN views_px BLOB",
        "ALTER TABLE pose_changes ADD COLUMN parts_px BLOB",
        "ALTER TABLE pose_changes ADD COLUMN remark TEXT",
    ),
    2: (
        "CREATE TABLE told (id INTEGER PRIMARY KEY, settings TEXT NOT NULL UNIQUE)",
        "ALTER TABLE pose_changes ADD COLUMN told INTEGER REFERENCES told",
    ),
    3: ("ALTER TABLE pose_changes ADD COLUMN reviewed INTEGER",),
    4: (
        "CREATE TABLE alternatives (change INTEGER NOT NULL REFERENCES pose_changes, rank INTEGER NOT NULL, "
        "model_revision INTEGER NOT NULL REFERENCES model_revisions, numbers BLOB NOT NULL, cost_px REAL, "
        "PRIMARY KEY (change, rank)) WITHOUT ROWID",
    ),
}
"""Statements that upgrade a store from each older version to the next."""
_MISSING_COLUMNS = {
    1: ("views_px", "parts_px", "remark", "told", "reviewed"),
    2: ("told", "reviewed"),
    3: ("reviewed",),
    4: (),
}
"""Columns of `pose_changes` that each older version lacks. A store opened read only is read through temporary views,
which hide the tables of the same names."""


def version(db: sqlite3.Connection) -> int:
    """Return the version of a store; 0 for an empty file."""
    return int(db.execute("PRAGMA user_version").fetchone()[0])


def upgrade(db: sqlite3.Connection) -> int:
    """Create the tables of a new store, or upgrade an older one, within a transaction of the caller.

    Returns:
        The version that the store then has. It is newer than `VERSION` if a newer program has upgraded it meanwhile.
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
    """Make an older store readable like one of today's without writing to it; returns the version it reads as."""
    found = version(db)
    if found not in _MISSING_COLUMNS:
        return found
    if _MISSING_COLUMNS[found]:
        nulls = ", ".join(f"NULL AS {column}" for column in _MISSING_COLUMNS[found])
        db.execute(f"CREATE TEMP VIEW pose_changes AS SELECT *, {nulls} FROM main.pose_changes")
    nulls = ", ".join(f"NULL AS {column}" for column in ("change", "rank", "model_revision", "numbers", "cost_px"))
    db.execute(f"CREATE TEMP VIEW alternatives AS SELECT {nulls} WHERE 0")
    if "told" in _MISSING_COLUMNS[found]:
        db.execute("CREATE TEMP VIEW told AS SELECT NULL AS id, NULL AS settings WHERE 0")
    return VERSION
