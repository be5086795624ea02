"""The tables of the store of annotations, and the upgrade of older versions.

An upgrade adds and renames tables and columns, and fills in checksums. It never changes what a row says, because undo
depends on the log of edits.
"""

import sqlite3
from collections.abc import Sequence

from tracker.session.store import checksums, records

VERSION = 11
"""Version of the store; older ones are upgraded, newer ones are refused."""

_SCHEMA = """
CREATE TABLE edits (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    parent INTEGER REFERENCES edits,          -- NULL for the first
    label TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, program TEXT NOT NULL,
    uid TEXT                                                     -- the same in all copies of the store
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
CREATE TABLE program_settings (                                  -- shared by the poses that were made with them
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
    settings TEXT,                                               -- of versions 1 and 2; NULL since
    views_px BLOB, parts_px BLOB,                                -- little-endian float64, NaN: unknown; NULL: none
    remark TEXT,
    program_settings INTEGER REFERENCES program_settings,
    reviewed INTEGER,                                            -- NULL: written before version 4, not reviewed
    limbs BLOB,                                                  -- like views_px: probability that a limb is lost
    errors BLOB,                                                 -- little-endian float32: upper triangles, m^2
    made_in INTEGER REFERENCES edits,                            -- of a pose that was only assessed: who made it
    trace TEXT                                                   -- searches on the frame; NULL: not known
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
"""The tables without their checksums, which `checksums.ADDED` adds."""
_TASKS = (
    "CREATE TABLE tasks (uid TEXT PRIMARY KEY, kind TEXT NOT NULL, person TEXT NOT NULL, frame INTEGER NOT NULL, "
    "annotator TEXT NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID",
    "CREATE TABLE task_states (uid TEXT PRIMARY KEY, task TEXT NOT NULL, state TEXT NOT NULL, comment TEXT NOT NULL, "
    "author TEXT NOT NULL, time TEXT NOT NULL, checksum INTEGER) WITHOUT ROWID",
    "CREATE TABLE comments (uid TEXT PRIMARY KEY, about TEXT NOT NULL, person TEXT NOT NULL, frame INTEGER NOT NULL, "
    "limb TEXT NOT NULL, text TEXT NOT NULL, resolved INTEGER NOT NULL, author TEXT NOT NULL, time TEXT NOT NULL, "
    "checksum INTEGER) WITHOUT ROWID",
)
"""The tables of the plan of annotation, with their checksums. Their rows are only added (`task_log`)."""
_DECIDED_POSES = ("ALTER TABLE task_states ADD COLUMN pose TEXT",)

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
    5: (
        "ALTER TABLE told RENAME TO program_settings",
        "ALTER TABLE pose_changes RENAME COLUMN told TO program_settings",
        *checksums.ADDED,
    ),
    6: ("ALTER TABLE pose_changes ADD COLUMN limbs BLOB",),
    7: ("ALTER TABLE pose_changes ADD COLUMN errors BLOB",),
    8: (
        "ALTER TABLE pose_changes ADD COLUMN made_in INTEGER REFERENCES edits",
        "ALTER TABLE pose_changes ADD COLUMN trace TEXT",
    ),
    9: ("ALTER TABLE edits ADD COLUMN uid TEXT", *_TASKS),
    10: _DECIDED_POSES,
}
"""Statements that upgrade a store from each older version to the next."""
STATEMENTS = (*_SCHEMA.split(";\n"), *checksums.ADDED, *(text for texts in _UPGRADES.values() for text in texts))
"""All statements that define tables and indices, of this version and older ones."""
_FORMER_SETTINGS = "told"
"""Name of the table and the column of settings in stores of versions 3 to 5."""
_RENAMED_SETTINGS = f"{_FORMER_SETTINGS} AS program_settings"
_SINCE_CHECKSUMS = checksums.LATER_COLUMNS[checksums.OLDEST_VERSION]["pose_changes"]
_MISSING_COLUMNS = {
    1: ("views_px", "parts_px", "remark", "program_settings", "reviewed", *_SINCE_CHECKSUMS),
    2: ("program_settings", "reviewed", *_SINCE_CHECKSUMS),
    3: (_RENAMED_SETTINGS, "reviewed", *_SINCE_CHECKSUMS),
    4: (_RENAMED_SETTINGS, *_SINCE_CHECKSUMS),
    5: (_RENAMED_SETTINGS, *_SINCE_CHECKSUMS),
    **{version: later.get("pose_changes", ()) for version, later in checksums.LATER_COLUMNS.items()},
}
"""Columns of `pose_changes` that each older version lacks or names differently. A store opened read only is read
through temporary views, which hide the tables of the same names."""


def version(db: sqlite3.Connection) -> int:
    """Return the version of a store; 0 for another file."""
    return int(db.execute("PRAGMA user_version").fetchone()[0])


def create(db: sqlite3.Connection) -> None:
    """Create the tables of a new store in an empty file, within a transaction of the caller."""
    _run(db, (*_SCHEMA.split(";\n"), *checksums.ADDED, *_TASKS, *_DECIDED_POSES))


def upgrade(db: sqlite3.Connection) -> int:
    """Upgrade an older store, within a transaction of the caller.

    Returns:
        The version that the store then has. It is newer than `VERSION` if a newer program has upgraded it meanwhile.
    """
    stored_version = version(db)
    if stored_version < VERSION:
        _run(db, [s for v in range(stored_version, VERSION) for s in _UPGRADES[v]])
    return max(stored_version, VERSION)


def _run(db: sqlite3.Connection, statements: Sequence[str]) -> None:
    for statement in statements:
        db.execute(statement)
    db.execute(f"UPDATE edits SET uid = {records.DERIVED} WHERE uid IS NULL")
    checksums.fill_in(db)
    db.execute(f"PRAGMA user_version = {VERSION}")


def show_as_new(db: sqlite3.Connection) -> None:
    """Make an older store readable like one of today's without writing to it."""
    stored_version = version(db)
    if stored_version == VERSION:
        return
    if stored_version >= checksums.TABLES_SINCE:
        db.execute("CREATE TEMP VIEW task_states AS SELECT *, NULL AS pose FROM main.task_states")
        return
    for table in checksums.LATER_TABLES:
        columns = checksums.COLUMNS[table].split(", ")
        db.execute(f"CREATE TEMP VIEW {table} AS SELECT {', '.join(f'NULL AS {c}' for c in columns)} WHERE 0")
    db.execute(f"CREATE TEMP VIEW edits AS SELECT *, {records.DERIVED} AS uid FROM main.edits")
    if stored_version == 9:
        return
    added = ", ".join(c if " AS " in c else f"NULL AS {c}" for c in _MISSING_COLUMNS[stored_version])
    db.execute(f"CREATE TEMP VIEW pose_changes AS SELECT *, {added} FROM main.pose_changes")
    if stored_version < 5:
        nulls = ", ".join(f"NULL AS {column}" for column in ("change", "rank", "model_revision", "numbers", "cost_px"))
        db.execute(f"CREATE TEMP VIEW alternatives AS SELECT {nulls} WHERE 0")
    if stored_version < 6:
        no_programs = "SELECT NULL AS id, NULL AS settings WHERE 0"
        programs = no_programs if stored_version < 3 else f"SELECT * FROM main.{_FORMER_SETTINGS}"
        db.execute(f"CREATE TEMP VIEW program_settings AS {programs}")
