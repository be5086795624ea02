"""The number of a picture in the name of its file, among dates, clocks, hashes and numbers of objects.

The number is the one that runs within a folder: it rises by one from picture to picture, and the others do not.
"""

import re
from collections import Counter
from collections.abc import Collection, Sequence
from datetime import date
from itertools import pairwise
from typing import NamedTuple

_DIGITS = re.compile(r"([0-9]{1,19})")
"""Digits of one number: as many as nanoseconds of Unix time have."""
_TIME = re.compile(
    r"(?<![0-9])(?:(?:(?P<date>(?:19|20)[0-9]{2}[-_.]?[01][0-9][-_.]?[0-3][0-9])[-_. T]?)?"
    r"(?P<h>[0-2][0-9])(?P<sign>[-_.:h]?)(?P<m>[0-5][0-9])(?:(?P=sign)|m)(?P<s>[0-5][0-9])|(?P<unix>1[0-9]{9}))s?"
    r"(?:[-_.,]?(?P<fraction>[0-9]{3}|[0-9]{6}|[0-9]{9})|[-_.,](?P<short>[0-9]{1,8}))?(?![0-9])"
    r"|(?<![0-9])(?P<seconds>[0-9]+)[-_.,](?P<part>[0-9]{1,9})(?![0-9])"
)
"""Times in names: date and clock, clock, Unix time, or seconds, all with digits of a fraction of a second."""


class PictureNumbers(NamedTuple):
    """The numbers and times in the names of a folder's pictures."""

    numbers: tuple[int, ...] | None
    """Number of the picture of each name, in the order of the names; None if they do not show it."""
    times: tuple[float, ...] | None = None
    """Time of each picture, s, or in an unknown unit if one uneven number is all; None if the names hold no time."""
    readings: tuple[tuple[int, ...], ...] = ()
    """Without numbers: the numbers of each reading of the names that is possible."""
    reason: str = ""
    """Without numbers: why, as the end of a sentence."""


def picture_numbers(names: Sequence[str], may_repeat: bool = False) -> PictureNumbers:
    """Find the number that runs in the names of a folder's pictures.

    Args:
        names: of the files of one camera without suffix, in any order, each once.
        may_repeat: whether several files may be of one picture, such as one for each object.
    """
    words = [re.split(r"([\W_]+)", name) for name in names]
    places = _places(words)
    if len(names) == 1:
        alone = next(iter(places)) if len(places) == 1 else None
        return PictureNumbers(alone, reason="" if alone else f"'{names[0]}' alone does not show which number counts")
    running = [c for c in places if len(set(c)) > 1]
    whole = [c for c in running if len(set(c)) == len(names) and _follows(c, _times(words, ()))]
    by_one = [c for c in whole if _usual_step(c) == 1]
    found = by_one or [c for c in whole if _usual_step(c)]
    times = _times(words, {places[c] for c in by_one})
    if not by_one and times is not None:
        found = []  # parts of a time
    if not found and times is None and whole and len(running) == 1:
        times = tuple(map(float, whole[0]))
    if not found and times is not None and len(set(times)) < len(times):
        times = None
    if may_repeat and not found and times is None:
        found = _of_several(running, names)
    if len(found) == 1:
        return PictureNumbers(found[0], times)
    if times is not None and not found:
        return PictureNumbers(None, times, reason=f"'{names[0]}' holds a time and no number that rises by one")
    readings = tuple(found or running)
    if not readings:
        return PictureNumbers(None, reason=f"no number alone changes from '{names[0]}' to '{names[-1]}'")
    listed = " or ".join(f"{c[0]} to {c[-1]}" for c in readings)
    return PictureNumbers(None, times, readings, f"from '{names[0]}' to '{names[-1]}' it may be {listed}")


def _places(words: Sequence[Sequence[str]]) -> dict[tuple[int, ...], tuple[int, int]]:
    """Return the numbers at each place of the names that has digits and else the same text in all, and the place.

    Args:
        words: of each name; separators lie at odd places.
    """
    places: dict[tuple[int, ...], tuple[int, int]] = {}
    for i, word in enumerate(zip(*words, strict=True)) if len({*map(len, words)}) == 1 else ():
        parts = [_DIGITS.split(text) for text in word]
        if len({tuple(p[::2]) for p in parts}) == 1:  # else a hash, or text that differs
            for k in range(1, len(parts[0]), 2):
                places.setdefault(tuple(int(p[k]) for p in parts), (i, k))
    return places


def _usual_step(values: Sequence[int]) -> int:
    """Return the usual step between numbers in ascending order, of which all others are multiples; 0 if none is."""
    steps = Counter(b - a for a, b in pairwise(sorted(set(values))))
    step = min(steps, key=lambda s: (-steps[s], s))
    # Numbers most of whose steps differ are times, hashes or the like.
    return step if 2 * steps[step] >= steps.total() and not any(s % step for s in steps) else 0


def _follows(values: Sequence[int], times: Sequence[float] | None) -> bool:
    """Return whether times, if there are any, do not go back where numbers rise: thousandths of a second do."""
    return times is None or all(a <= b for a, b in pairwise(t for _, t in sorted(zip(values, times, strict=True))))


def _of_several(running: Sequence[tuple[int, ...]], names: Sequence[str]) -> list[tuple[int, ...]]:
    """Return the numbers that may be the picture's where others are of objects: these are few, and not padded."""
    regular = [c for c in running if _usual_step(c)]
    most = max((len(set(c)) for c in regular), default=0)
    many = [c for c in regular if 2 * len(set(c)) > most]
    padded = [c for c in many if re.search(rf"(?<![0-9])0+{min(c)}(?![0-9])", names[c.index(min(c))])]
    return padded if len(padded) == 1 else many


def _times(words: Sequence[Sequence[str]], index: Collection[tuple[int, int]]) -> tuple[float, ...] | None:
    """Return the time in each name, s, if all have one and they differ.

    Args:
        words: of each name.
        index: places whose digits are no part of a time.
    """
    wholes, digits, is_number = [], [], False
    for name in words:
        parts = [_DIGITS.split(text) for text in name]
        for i, k in index:
            parts[i][k] = "#"
        time = _TIME.search("".join(map("".join, parts)))
        if time is None:
            return None
        wholes.append(_whole_seconds(time))
        digits.append(time["fraction"] or time["short"] or time["part"] or "0")
        is_number = is_number or time["seconds"] is not None
    fractions = _fractions(digits)
    if fractions is None:
        if is_number:
            return None
        fractions = [0.0] * len(wholes)
    times = [whole + fraction for whole, fraction in zip(wholes, fractions, strict=True)]
    is_counted = len({*wholes}) < len(times) and max(fractions) < 0.5  # within each second
    return None if len(set(times)) == 1 or (is_counted and len(set(times)) > len({*wholes})) else tuple(times)


def _fractions(digits: Sequence[str]) -> list[float] | None:
    """Return fractions of a second; None if their digits are none, or may be decimals or a number without zeros ahead.

    Decimals end in no 0 where they are not all of one length, and whole thousandths or the like begin with none.
    """
    width = max(map(len, digits))
    several = [d for d in digits if len(d) > 1]
    is_even = len({*map(len, digits)}) == 1
    is_decimal = is_even or any(d[0] == "0" for d in several)
    if width % 3 or not (is_decimal or any(d[-1] == "0" for d in several)):
        return None
    return [int(d) / 10 ** (len(d) if is_decimal else width) for d in digits]


def _whole_seconds(found: re.Match[str]) -> float:
    if found["h"] is None:
        return float(found["unix"] or found["seconds"])
    clock = 3600 * int(found["h"]) + 60 * int(found["m"]) + int(found["s"])
    if found["date"] is None:
        return float(clock)
    digits = re.sub("[^0-9]", "", found["date"])
    try:
        return float(86400 * date.fromisoformat(digits).toordinal() + clock)
    except ValueError:
        return float(clock)
