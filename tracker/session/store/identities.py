"""Identities of edits, tasks and comments, which all copies of a store share.

New rows get a random identity. Edits of a store of version 9 or older get one that follows from the row, so that
two copies that were upgraded apart agree about the edits that they had in common.
"""

import secrets
import sqlite3
from hashlib import sha256

DERIVED = "edit_uid((SELECT value FROM main.settings WHERE key = 'store_id'), id, parent, label, author, time, program)"
"""SQL for the identity of a row of `edits` of an older store."""


def new_uid() -> str:
    """Return a random identity of 128 bits, 32 hexadecimal digits."""
    return secrets.token_hex(16)


def derived_uid(*content: object) -> str:
    """Return the identity that follows from the content of a row: texts, numbers and None."""
    # `ascii` writes them the same in all versions of Python; 32 digits are 128 bits, as for new rows.
    return sha256(ascii(content).encode("ascii")).hexdigest()[:32]


def register(db: sqlite3.Connection) -> None:
    """Make `edit_uid` known to a connection."""
    db.create_function("edit_uid", -1, derived_uid, deterministic=True)
