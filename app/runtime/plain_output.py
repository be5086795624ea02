"""Show on a terminal only what a person can read: texts of files may hold sequences that the terminal obeys."""

import re
from typing import Any, TextIO

from tracker.validation import UNPRINTABLE

_ODD = re.compile(rf"(?![\n\t])[{UNPRINTABLE}]")


def printable(text: str) -> str:
    """Replace control and direction characters, except line ends and tabs, by escapes such as \\u001b, as JSON does."""
    return _ODD.sub(lambda odd: f"\\u{ord(odd[0]):04x}", text)


class PlainOutput:
    """A text stream that writes `printable` text."""

    def __init__(self, stream: TextIO) -> None:
        """Write to a stream."""
        self._stream = stream

    def write(self, text: str) -> int:
        """Write text; returns its length."""
        self._stream.write(printable(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        """Return what else the stream offers."""
        return getattr(self._stream, name)
