"""Recordings of a dataset and their splits: each recording is in one of training, validation and test."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from tracker.errors import FormatError
from tracker.formats.file_names import identifier, identifiers

Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = get_args(Split)


@dataclass(frozen=True)
class SplitChoice:
    """How recordings are divided."""

    shares: tuple[float, ...] = ()
    """Share of each of `SPLITS`, in any unit; empty to put all recordings in the first one."""
    named: Mapping[str, Split] = field(default_factory=dict)
    """The split of recordings that have one, by name."""

    @property
    def sentence(self) -> str:
        """A sentence on the choice, for the card."""
        others = "Recordings" if not self.named else "Recordings whose split was not given"
        if not self.shares:
            return f"{others} are in `train`."
        text = ":".join(f"{share:g}" for share in self.shares)
        return f"{others} are divided {text}, in the order of the SHA-256 of their names."


def parse_splits(words: Sequence[str], option: str) -> SplitChoice:
    """Parse the shares of the splits, such as 70:15:15, and NAME=test.

    Raises:
        FormatError: a word is neither, or a recording has two splits.
    """
    shares: tuple[float, ...] = ()
    named: dict[str, Split] = {}
    for word in words:
        name, equals, value = word.rpartition("=")
        split = next((s for s in SPLITS if s == value), None)
        if equals and name and split and named.get(name, split) == split:
            named[name] = split
        elif not equals and not shares and (numbers := _shares(word)):
            shares = numbers
        else:
            raise FormatError(
                f"expected {option} as TRAIN:VALIDATION:TEST once, such as 70:15:15, and as NAME=SPLIT with a split of "
                f"{', '.join(SPLITS)}, once for a recording; found '{word}'"
            )
    return SplitChoice(shares, named)


def _shares(word: str) -> tuple[float, ...]:
    """Return the shares in a word; empty if it has none."""
    try:
        found = tuple(float(x) for x in word.split(":"))
    except ValueError:
        return ()
    return found if len(found) == len(SPLITS) and min(found) >= 0 and 0 < sum(found) < float("inf") else ()


def divide(names: Sequence[str], choice: SplitChoice) -> dict[Split, list[str]]:
    """Return the recordings of each split, in the order given.

    The same names and choice give the same splits, in whatever order the names are. A split with a share gets at least
    one recording if there are enough.

    Raises:
        FormatError: a split is given to a recording that there is not.
    """
    unknown = [name for name in choice.named if name not in names]
    if unknown:
        raise FormatError(f"expected splits of the recordings {', '.join(names)}, found one of '{unknown[0]}'")
    found = dict(choice.named)
    free = sorted((n for n in names if n not in found), key=lambda n: hashlib.sha256(n.encode()).digest())
    for split, n in zip(SPLITS, _numbers(len(free), choice.shares or (1.0, 0.0, 0.0)), strict=True):
        found |= dict.fromkeys(free[:n], split)
        free = free[n:]
    return {split: [name for name in names if found[name] == split] for split in SPLITS}


def _numbers(n: int, shares: tuple[float, ...]) -> list[int]:
    """Return the number of recordings in each split: one of each with a share, then where most are missing."""
    numbers = [0] * len(shares)
    for _ in range(n):
        lacking = [s * n / sum(shares) - k if s else -n for s, k in zip(shares, numbers, strict=True)]
        if n >= sum(s > 0 for s in shares) and any(s and not k for s, k in zip(shares, numbers, strict=True)):
            lacking = [x if not k else -n for x, k in zip(lacking, numbers, strict=True)]
        numbers[lacking.index(max(lacking))] += 1
    return numbers


def recording_names(folders: Sequence[Path]) -> list[str]:
    """Return a name for the recording of each session: that of its folder, with those around it where names coincide.

    Raises:
        FormatError: a folder is given twice.
    """
    places = [folder.resolve() for folder in folders]
    twice = [folder for folder, place in zip(folders, places, strict=True) if places.count(place) > 1]
    if twice:
        raise FormatError(f"expected each session once, found {twice[0]} twice; leave one out")
    names = [identifier(place.name) for place in places]
    for depth in range(2, max((len(p.parts) for p in places), default=0)):
        plain = [name.lower() for name in names]  # some file systems ignore case
        if len(set(plain)) == len(plain):
            break
        names = [
            identifier("_".join(place.parts[-depth:])) if plain.count(name.lower()) > 1 else name
            for name, place in zip(names, places, strict=True)
        ]
    return identifiers(names)
