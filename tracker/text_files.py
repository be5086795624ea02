"""Read text files within limits, with errors that name the file and the place."""

import io
import os
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from tracker.errors import TrackerError
from tracker.files import IrregularFileError, open_regular

MAX_NESTING = 32
"""Deepest nesting of brackets and longest dotted key of a TOML file."""
_MAX_LINE = 1_000_000
"""Longest line of a table, characters."""


_PIPE_OF_SHELL = re.compile(r"/dev/fd/\d+|/proc/self/fd/\d+")


@dataclass(frozen=True)
class TextKind:
    """A kind of text file."""

    name: str
    """Name for messages: `calibration`."""
    max_bytes: int
    """Size above which a file is refused before it is read. Real files never reach it."""
    error: type[TrackerError]
    """Kind of error that a bad file raises."""
    remedy: str = "correct it"
    """Advice to a person whose file cannot be read as text."""


def read_text(path: Path, kind: TextKind) -> str:
    """Read a whole text file.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not UTF-8 text.
    """
    with _reading(path, kind), _open(path) as file:
        _check_size(os.fstat(file.fileno()).st_size, path, kind)
        data = file.read(kind.max_bytes + 1)  # a pipe does not know its size
        _check_size(len(data), path, kind)
        return data.decode("utf-8-sig")


def read_lines(path: Path, kind: TextKind) -> Iterator[str]:
    """Yield the lines of a text file, without their ends. Only one line is in memory.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not UTF-8 text, or a line is too long.
    """
    with _reading(path, kind), io.TextIOWrapper(_open(path), encoding="utf-8-sig") as file:
        _check_size(os.fstat(file.fileno()).st_size, path, kind)
        size = number = 0
        while line := file.readline(_MAX_LINE + 1):
            size, number = size + len(line), number + 1
            _check_size(size, path, kind)
            if len(line) > _MAX_LINE:
                raise kind.error(
                    f"{kind.name} {path}, line {number}: expected at most {_MAX_LINE} characters; {kind.remedy}"
                )
            yield line.rstrip("\n")


def read_toml(path: Path, kind: TextKind) -> dict[str, Any]:
    """Parse a TOML file.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, unreadable, or not TOML (the message has the
            line).
    """
    return parse_toml(read_text(path, kind), str(path), kind)


def parse_toml(text: str, source: str, kind: TextKind) -> dict[str, Any]:
    """Parse TOML text; `source` names it in messages.

    Raises:
        TrackerError: of the kind's type; the text is nested too deep, or not TOML (the message has the line).
    """
    where = f"{kind.name} {source}"
    # tomllib's time grows with the square of the depth, and it recurses.
    plain = _OPAQUE.sub("_", text)
    depth = max(accumulate((1 if c in "[{" else -1 for c in re.findall(r"[\[\]{}]", plain)), initial=0))
    too_deep = f"{where}: expected at most {MAX_NESTING} levels of nesting, found more; correct it"
    if depth > MAX_NESTING or _LONG_KEY.search(plain):
        raise kind.error(too_deep)
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        # Possessive quantifiers of Python 3.11.2 match too little, so that some strings hide brackets after them.
        raise kind.error(too_deep) from error
    except ValueError as error:
        # The parser gives no line for a construct left open at the end: report the last line.
        place = str(error).replace("at end of document", f"at line {max(1, len(text.splitlines()))}, the last")
        raise kind.error(f"{where} is not valid TOML: {place}; correct it") from error


def read_json(path: Path, kind: TextKind) -> Any:
    """Parse a JSON file.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not JSON.
    """
    text = read_text(path, kind)
    try:
        return msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError) as error:
        raise kind.error(f"{kind.name} {path} is not valid JSON: {error}; {kind.remedy}") from error


def _open(path: Path) -> BinaryIO:
    """Open a regular file, or a pipe that a shell has opened, as in `--calibration <(command)`: that one has a writer.

    Raises:
        OSError: it is neither, or cannot be read.
    """
    return path.open("rb") if _PIPE_OF_SHELL.fullmatch(str(path)) else open_regular(path)


@contextmanager
def _reading(path: Path, kind: TextKind) -> Iterator[None]:
    """Raise the kind's error for what goes wrong while a file is read."""
    try:
        yield
    except FileNotFoundError as error:
        raise kind.error(f"{kind.name} {path} not found; check the path") from error
    except IrregularFileError as error:
        raise kind.error(f"{kind.name} {path} cannot be read: {error.strerror}; {kind.remedy}") from error
    except (OSError, ValueError) as error:  # a null byte in a path is a ValueError, wrong UTF-8 too
        raise kind.error(
            f"{kind.name} {path} cannot be read: expected UTF-8 text, found: {error}; {kind.remedy}"
        ) from error


def _check_size(n_bytes: int, path: Path, kind: TextKind) -> None:
    if n_bytes > kind.max_bytes:
        raise kind.error(
            f"{kind.name} {path}: expected at most {kind.max_bytes / 1e6:g} MB, found more; check that it is the "
            "right file"
        )


# Strings and comments; one that is left open goes on to the end of its line or of the text.
_OPAQUE = re.compile(
    r""""{3}(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)|'{3}(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"""
    r"""|"(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?|#[^\n]*+""",
    re.DOTALL,
)
_LONG_KEY = re.compile(rf"(?:\.[ \t]*+[\w-]++[ \t]*+){{{MAX_NESTING}}}")
