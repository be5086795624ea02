"""Check the name that a person joins by, and compare names as eyes do."""

import re
import unicodedata
from functools import cache

from tracker.errors import TrackerError
from tracker.session.store.annotator import checked_annotator, one_form
from tracker.validation import quoted

MAX_CHARACTERS = 60
"""Length of a name at most: all pages show it in one line."""
_MAX_MARKS = 4
"""Marks on one letter at most (Unicode TS 39, 5.4)."""
_INVISIBLE = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0\ufffc\U00016fe4\U0001d159"
    "\U000e0100-\U000e01ef]"
)
"""Characters that count as printable and show nothing: those of Unicode's Default_Ignorable_Code_Point, and blanks."""


def joined_name(text: str) -> str:
    """Return a name without superfluous space, in one form of Unicode; empty for none.

    Raises:
        TrackerError: it is too long, has no letter or digit, or has characters that nobody can see or tell apart.
    """
    name = one_form(text)
    if not name:
        return ""
    if len(name) > MAX_CHARACTERS:
        raise TrackerError(
            f"expected a name of at most {MAX_CHARACTERS} visible characters, found {quoted(name)}; choose another"
        )
    hidden = next((c for c in name if not c.isprintable() or _INVISIBLE.match(c)), None)
    if hidden is not None:
        raise TrackerError(f"expected a name of visible characters, found U+{ord(hidden):04X} in it; choose another")
    kinds = "".join(unicodedata.category(c)[0] for c in unicodedata.normalize("NFD", name))
    if not re.search("[LN]", kinds) or kinds[0] == "M" or "M" * (_MAX_MARKS + 1) in kinds:
        raise TrackerError(
            f"expected a name with a letter or digit and at most {_MAX_MARKS} marks on each, found {quoted(name)}; "
            "choose another"
        )
    return checked_annotator(name)


def is_same(one: str, other: str) -> bool:
    """Return whether two names are the same but for capitals and forms of letters."""
    return _folded(one) == _folded(other)


def looks_alike(one: str, other: str) -> bool:
    """Return whether people would take two names for the same: their letters look alike (Unicode TS 39, 4)."""
    return not _skeletons(one).isdisjoint(_skeletons(other))


def _folded(name: str) -> str:
    return unicodedata.normalize("NFKC", name).casefold()


def _skeletons(name: str) -> set[str]:
    """Return a name with each letter replaced by the one that it stands for, as it is and without capitals."""
    return {_skeleton(name).casefold(), _skeleton(_folded(name))}


def _skeleton(name: str) -> str:
    return unicodedata.normalize("NFD", "".join(map(_prototype, unicodedata.normalize("NFD", name))))


@cache
def _prototype(letter: str) -> str:
    """Return the letter or letters that represent all those that look like a letter."""
    from confusable_homoglyphs.confusables import confusables_data

    # The table has a letter with its prototype, and a prototype with all its letters.
    listed = [found["c"] for found in confusables_data.get(letter, ())]
    return max((letter, *listed), key=lambda c: (len(confusables_data.get(c, ())), len(c), c))
