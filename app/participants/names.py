"""Check the name that a person joins by."""

import unicodedata

from tracker.errors import TrackerError
from tracker.store.annotator import checked_annotator, one_form
from tracker.validation import quoted

MAX_CHARACTERS = 60
"""Length of a name at most: all pages show it in one line."""


def joined_name(text: str) -> str:
    """Return a name without superfluous space, in one form of Unicode; empty for none.

    Raises:
        TrackerError: it is too long, or has characters that nobody can see.
    """
    name = one_form(text)
    if not name:
        return ""
    if len(name) > MAX_CHARACTERS or not name.isprintable():
        raise TrackerError(
            f"expected a name of at most {MAX_CHARACTERS} visible characters, found {quoted(name)}; choose another"
        )
    return checked_annotator(name)


def is_same(one: str, other: str) -> bool:
    """Return whether people would take two names for the same."""
    return _folded(one) == _folded(other)


def _folded(name: str) -> str:
    return unicodedata.normalize("NFKC", name).casefold()
