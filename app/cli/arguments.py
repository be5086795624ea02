"""Words of the command line that hold values for several people or views: NAME=VALUE."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from tracker.errors import TrackerError

T = TypeVar("T")


def pairs(words: Sequence[str], option: str, kind: Callable[[str], T]) -> dict[str, T]:
    """Parse NAME=VALUE words."""
    out: dict[str, T] = {}
    for word in words:
        name, equals, value = word.partition("=")
        try:
            if not equals or not name:
                raise ValueError
            out[name] = kind(value)
        except ValueError:
            raise TrackerError(f"expected {option} as NAME=VALUE, found '{word}'") from None
    return out


def common_or_pairs(words: Sequence[str], option: str, kind: Callable[[str], T]) -> Mapping[str, T] | T | None:
    """Parse one value for everybody, or NAME=VALUE words; None where there are none."""
    if len(words) == 1 and "=" not in words[0]:
        try:
            return kind(words[0])
        except ValueError:
            raise TrackerError(f"expected {option} as a value or NAME=VALUE, found '{words[0]}'") from None
    return pairs(words, option, kind) or None
