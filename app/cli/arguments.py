"""Arguments that several commands share: SESSION, options that may be left out, and words such as NAME=VALUE."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import is_dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar, get_args, get_origin, get_type_hints

import tyro

from tracker.errors import TrackerError
from tracker.validation import nfc_name

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


def gather_repeated(words: Sequence[str], command: Callable[..., None]) -> list[str]:
    """Return the words of a command line with the values of an option that is repeated behind the first of them.

    Args:
        words: the command's name and its arguments.
        command: takes them.

    Raises:
        TrackerError: an option that takes one value is repeated.
    """
    groups: list[tuple[str, list[str]]] = [("", [])]
    for word in words:
        if word.startswith("--"):
            groups.append((word.partition("=")[0].replace("_", "-"), []))
        groups[-1][1].append(word)
    gathered: dict[str, list[str]] = {}
    for option, group in groups:
        first = gathered.setdefault(option, group)
        values = _values(group)
        if first is group or not values:
            continue
        if option not in repeatable(command):
            raise TrackerError(
                f"expected {option} once, found it with {' '.join(_values(first))} and with {' '.join(values)}; "
                "leave one out"
            )
        first += values
    return [word for group in gathered.values() for word in group]


def _values(group: Sequence[str]) -> list[str]:
    """Return the values of an option, given as the words `--option=VALUE` or `--option VALUE ...`."""
    _, equals, value = group[0].partition("=")
    return [*([value] if equals else []), *group[1:]]


def repeatable(function: Callable[..., object]) -> set[str]:
    """Return the options of a command that take any number of values; its parameters may be dataclasses of options."""
    found = set[str]()
    for name, hint in get_type_hints(function).items():
        if is_dataclass(hint) and isinstance(hint, type):
            found |= repeatable(hint)
        elif any(get_origin(h) is tuple and Ellipsis in get_args(h) for h in (hint, *get_args(hint))):
            found.add(f"--{name.replace('_', '-')}")
    return found


def parse_pairs(words: Sequence[str], option: str, kind: Callable[[str], T]) -> dict[str, T]:
    """Parse NAME=VALUE words.

    Raises:
        TrackerError: one is none, or a name has two values.
    """
    out: dict[str, T] = {}
    given: dict[str, str] = {}
    for word in words:
        name, equals, value = word.partition("=")
        try:
            if not (name and equals and value):
                raise ValueError
            out[name] = kind(value)
        except ValueError:
            raise TrackerError(f"expected {option} as NAME=VALUE, found '{word}'") from None
        if nfc_name(name) in given:
            raise TrackerError(
                f"expected {option} once for '{name}', found {given[nfc_name(name)]} and {word}; leave one out"
            )
        given[nfc_name(name)] = word
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
    """Parse one value for all people, or NAME=VALUE words; None if there are no words.

    Raises:
        TrackerError: a word is neither, or there are several values for all people.
    """
    if len(words) == 1 and "=" not in words[0]:
        try:
            return kind(words[0])
        except ValueError:
            raise TrackerError(f"expected {option} as a value or NAME=VALUE, found '{words[0]}'") from None
    if any("=" not in word for word in words):
        expected, found = f"{option} once for all people, or as NAME=VALUE for each", " and ".join(words)
        raise TrackerError.mismatch("", expected, found, "leave one out")
    return parse_pairs(words, option, kind) or None
