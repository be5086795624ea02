"""Words of calibrations of all programs: `words.toml` has a row of them for each meaning."""

import re
from fnmatch import translate

from tracker.formats.anipose import KIND
from tracker.formats.text_files import packaged_texts, parse_toml

_TABLE = parse_toml(packaged_texts("formats", "calibrations")["words"], "words.toml", KIND)
MEANINGS: dict[str, str] = {word: meaning for meaning, words in _TABLE["meanings"].items() for word in words.split()}
"""Meaning of a value of a camera by each word for it."""
LISTS = tuple(_TABLE["rows"]["lists"].split())
"""Keys under which the cameras of a file may lie, the surest first."""
_ROWS = {name: re.compile("|".join(map(translate, words.split()))) for name, words in _TABLE["rows"].items()}


def spelled(key: str) -> str:
    """Return a key without case and separators."""
    return "".join(c for c in key.lower() if c.isalnum())


def is_of(row: str, word: str) -> bool:
    """Return whether a word, of any case and with any separators, is in a row of the table."""
    return _ROWS[row].match(spelled(word)) is not None


def is_known(key: str) -> bool:
    """Return whether a key is the word for a value of a camera."""
    return spelled(key) in MEANINGS or is_of("numbers", key)
