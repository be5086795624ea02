"""Find the number of the picture in the names of files: the one that runs.

Constants, hashes, and numbers of cameras, objects and people are none.
"""

import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from tracker.validation import MAX_FRAMES

_OTHER = re.compile(r"(?<![A-Za-z])(?:cam(?:era)?|view|obj(?:ect)?|person|id|track)[\W_]*\Z", re.IGNORECASE)
"""Words before a number of something else than a picture."""
_RATE = re.compile(r"[\W_]*(?:fps|hz)", re.IGNORECASE)
"""Words after a rate."""
_HASH = re.compile(r"[0-9A-Za-z]{8,}")
"""Words that may be hashes: those of Label Studio have 8 digits, those of Roboflow 20 or more."""


class PictureName(NamedTuple):
    """The name of the file of a picture, taken apart."""

    label: str
    """The name without its number and without a hash."""
    number: int


def picture_names(stems: Sequence[str]) -> list[PictureName | None]:
    """Take the names of the pictures of a folder apart; None for one without a number.

    Names with equally many numbers are alike. The picture is a number with leading zeros, else the one that takes most
    values among them. Among equals it is the one with most steps of one, then one that stands alone, the longest, and
    the last.

    Args:
        stems: names of files without their suffix.
    """
    rows = [re.split(r"([0-9]+)", stem) for stem in _without_hashes(stems)]
    out: list[PictureName | None] = [None] * len(rows)
    for some in _by_length(rows):
        column = _running([rows[i] for i in some])
        if column is None:
            continue
        for i in some:
            before, after = ("".join(part) for part in (rows[i][:column], rows[i][column + 1 :]))
            label = re.sub(r"[\W_]+\Z", "", before) + re.sub(r"[\W_]+\Z", "", after)
            out[i] = PictureName(re.sub(r"\A[\W_]+", "", label), int(rows[i][column]))
    return out


def _by_length(rows: Sequence[Sequence[str]]) -> list[list[int]]:
    """Return the places of rows of one length, together."""
    found: dict[int, list[int]] = {}
    for i, row in enumerate(rows):
        found.setdefault(len(row), []).append(i)
    return list(found.values())


def _running(rows: Sequence[Sequence[str]]) -> int | None:
    """Return the column of the number of the picture; None if no number is small enough."""
    n_digits = len(str(MAX_FRAMES))
    small = [c for c in range(1, len(rows[0]), 2) if all(len(row[c].lstrip("0")) <= n_digits for row in rows)]
    return max(small, key=lambda c: _likeness(rows, c), default=None)


def _likeness(rows: Sequence[Sequence[str]], column: int) -> tuple[float, ...]:
    """Return values that are larger for a column that is rather the number of the picture, the most important first."""
    before, text, after = rows[0][column - 1 : column + 2]
    values = sorted({int(row[column]) for row in rows})
    steps_of_one = sum(b - a == 1 for a, b in pairwise(values))
    stands_alone = not (before[-1:].isalpha() or after[:1].isalpha())
    is_other = _OTHER.search(before) or _RATE.match(after)
    has_zeros = any(len(row[column]) > 2 and row[column].startswith("0") for row in rows)
    return (not is_other, has_zeros, len(values), steps_of_one, stands_alone, len(text), column)


def _without_hashes(stems: Sequence[str]) -> list[str]:
    """Return names without words that are another mix of letters and digits in each."""
    rows = [re.split(r"([^0-9A-Za-z]+)", stem) for stem in stems]
    for some in _by_length(rows):
        for column in range(0, len(rows[some[0]]), 2):
            if _are_hashes([rows[i][column] for i in some]):
                for i in some:
                    rows[i][column] = ""
    return ["".join(row) for row in rows]


def _are_hashes(words: Sequence[str]) -> bool:
    shapes = {re.sub(r"[0-9]+", "0", word) for word in words}
    is_other = len(set(words)) == len(words) and (len(shapes) > 1 or len(words) == 1)
    return is_other and all(map(_HASH.fullmatch, words)) and 2 * sum(map(_is_mixed, words)) > len(words)


def _is_mixed(word: str) -> bool:
    """Return whether letters and digits follow each other more than once: `img003` and `30fps` are no hashes."""
    return len(re.findall(r"[0-9]+|[A-Za-z]+", word)) > 2
