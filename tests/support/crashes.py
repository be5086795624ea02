"""What a crash in the middle of a commit leaves: a store whose journal must be rolled back before it can be read."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path


def crashed_in_a_commit(path: Path) -> None:
    """Make a store what it would be if a program were killed while it writes 'half-written' into each edit's label.

    The store grows by a table that the journal takes away again, so that SQLite writes pages before the commit.
    """
    files = (path, path.with_name(f"{path.name}-journal"))
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        db.execute("PRAGMA cache_size = 1")
        db.execute("BEGIN IMMEDIATE")
        db.execute("UPDATE edits SET label = 'half-written'")
        db.execute("CREATE TABLE filling (content BLOB)")
        for _ in range(50):
            db.execute("INSERT INTO filling VALUES (zeroblob(20000))")
        for file in files:
            shutil.copyfile(file, file.with_name(f"{file.name}.crashed"))
        db.execute("ROLLBACK")
    for file in files:
        file.with_name(f"{file.name}.crashed").replace(file)
