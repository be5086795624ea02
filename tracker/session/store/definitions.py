"""Check that a store defines nothing but the tables of the program, before anything else is asked of it.

A trigger or view of somebody else would run with the program's own statements: it could delete poses behind an edit
that is shown as saved, or never end.
"""

import re
import sqlite3
from functools import cache

from tracker.session.store import schema

_WORD = re.compile(r'"(\w+)"|--[^\n]*|(\w+)|(\S)')
"""A quoted or bare word, a comment, or another character."""
_BY_SQLITE = {"CREATE TABLE sqlite_sequence(name,seq)"}
"""Definitions that SQLite adds by itself; those of primary keys have no text."""


def foreign_definition(db: sqlite3.Connection) -> str | None:
    """Return what a store of this version or an older one defines that no version of the program does; None if nothing.

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
