"""Arguments that several commands share: SESSION, options that may be left out, and words such as NAME=VALUE."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import tyro

from tracker.errors import TrackerError

T = TypeVar("T")

SessionArg = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION", help="session folder")]

OptionalPath = Annotated[Path | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")]
OptionalName = Annotated[str | None, tyro.conf.arg(metavar="NAME", help_behavior_hint="")]
OptionalRange = Annotated[str | None, tyro.conf.arg(metavar="A:B", help_behavior_hint="")]
OptionalNumber = Annotated[float | None, tyro.conf.arg(metavar="NUMBER", help_behavior_hint="")]
OptionalWhole = Annotated[int | None, tyro.conf.arg(metavar="N", help_behavior_hint="")]
OptionalClock = Annotated[Literal["frames", "time"] | None, tyro.conf.arg(metavar="frames|time", help_behavior_hint="")]
Paths = Annotated[tuple[Path, ...], tyro.conf.arg(metavar="PATH ...", help_behavior_hint="")]
Names = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...", help_behavior_hint="")]
NamedPaths = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=PATH ...", help_behavior_hint="")]
NamedValues = Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=VALUE ...", help_behavior_hint="")]
CommonOrNamed = Annotated[tuple[str, ...], tyro.conf.arg(metavar="VALUE | NAME=VALUE ...", help_behavior_hint="")]


def parse_pairs(words: Sequence[str], option: str, kind: Callable[[str], T]) -> dict[str, T]:
    """Parse NAME=VALUE words."""
    out: dict[str, T] = {}
    for word in words:
        name, equals, value = word.partition("=")
        try:
            if not (name and equals and value):
                raise ValueError
            out[name] = kind(value)
        except ValueError:
            raise TrackerError(f"expected {option} as NAME=VALUE, found '{word}'") from None
    return out


def finite(text: str) -> float:
    """Parse a finite number.

    Raises:
        ValueError: it is none.
    """
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def parse_common_or_pairs(words: Sequence[str], option: str, kind: Callable[[str], T]) -> Mapping[str, T] | T | None:
    """Parse one value for all people, or NAME=VALUE words; None if there are no words."""
    if len(words) == 1 and "=" not in words[0]:
        try:
            return kind(words[0])
        except ValueError:
            raise TrackerError(f"expected {option} as a value or NAME=VALUE, found '{words[0]}'") from None
    return parse_pairs(words, option, kind) or None
