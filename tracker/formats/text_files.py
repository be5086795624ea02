"""Read text files within limits, with errors that name the file and the place.

Text is UTF-8, or UTF-16 or UTF-32 with a byte order mark. Bytes of another encoding, such as Latin-1, become U+FFFD
(`LOST`): comments and paths may hold them, names may not (`refuse_lost`).
"""

import codecs
import os
import re
import tomllib
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from io import BufferedReader, TextIOWrapper
from itertools import accumulate
from pathlib import Path
from typing import Any

import msgspec

from tracker import system
from tracker.errors import TrackerError
from tracker.files import open_regular

MAX_NESTING = 32
"""Deepest nesting of brackets and longest dotted key of a TOML file."""
LOST = "\N{REPLACEMENT CHARACTER}"
"""Stands for each byte that is not UTF-8."""
_FREE = re.compile("path|folder|directory|comment|note|remark|description|date|author|user|operator|software", re.I)
"""Keys whose values are free text: no program looks for a camera, joint or file by them."""
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f]")
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32-le"),  # begins as UTF-16's
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
"""First bytes of texts, and the encodings in which the mark is a character."""
DOCUMENT_BYTES = 500_000
"""Size above which a document that people write is refused: a body of 20 parts takes 10 kB, a camera of a session 100
bytes."""
TABLE_BYTES = 1_000_000_000
"""Size above which a table of numbers is refused: an hour of 50 joints at 120 Hz, in digits."""
_MAX_LINE = 1_000_000
"""Longest line of a table, characters."""


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


def packaged_texts(*folders: str) -> dict[str, str]:
    """Return the texts of the TOML files in a folder of the package by their names without suffix, in order."""
    files = sorted(resources.files("tracker").joinpath(*folders).iterdir(), key=lambda file: file.name)
    return {f.name.removesuffix(".toml"): f.read_text("utf-8") for f in files if f.name.endswith(".toml")}


def read_text(path: Path, kind: TextKind) -> str:
    """Read a whole text file; `LOST` stands for bytes that are not UTF-8.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not text.
    """
    with _reading(path, kind), _open(path) as file:
        size = os.fstat(file.fileno()).st_size
        _check_size(size, path, kind)
        data = file.read((size or kind.max_bytes) + 1)  # a pipe does not know its size
        _check_size(len(data), path, kind)
        encoding = _encoding_of(data)
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            text = data.decode(encoding, "replace")
            if encoding != "utf-8-sig" or _CONTROL.search(text):
                raise  # no text of any encoding
            return text


def read_lines(path: Path, kind: TextKind, keep_ends: bool = False) -> Iterator[str]:
    """Yield the lines of a text file, by default without their ends. Only one line is in memory.

    `LOST` stands for bytes that are not UTF-8.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not text, or a line is too long.
    """
    with _reading(path, kind), _open(path) as data:
        _check_size(os.fstat(data.fileno()).st_size, path, kind)
        encoding = _encoding_of(data.peek(4))
        file = TextIOWrapper(data, encoding, errors="replace" if encoding == "utf-8-sig" else "strict")
        size = number = 0
        while line := file.readline(_MAX_LINE + 1):
            size, number = size + len(line), number + 1
            _check_size(size, path, kind)
            if len(line) > _MAX_LINE:
                raise kind.error(
                    f"{kind.name} {path}, line {number}: expected at most {_MAX_LINE} characters; {kind.remedy}"
                )
            if LOST in line and _CONTROL.search(line):
                raise ValueError(f"other bytes in line {number}")
            yield line if keep_ends else line.rstrip("\n")


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
        data = tomllib.loads(text)
    except RecursionError as error:
        # Possessive quantifiers of Python 3.11.2 match too little, so that some strings hide brackets after them.
        raise kind.error(too_deep) from error
    except ValueError as error:
        # The parser gives no line for a construct left open at the end: report the last line.
        place = str(error).replace("at end of document", f"at line {max(1, len(text.splitlines()))}, the last")
        raise kind.error(f"{where} is not valid TOML: {place}; correct it") from error
    if LOST in text:
        refuse_lost(data, where, kind)
    return data


def read_json(path: Path, kind: TextKind) -> Any:
    """Parse a JSON file.

    Raises:
        TrackerError: of the kind's type; the file is missing, too large, or not JSON.
    """
    text = read_text(path, kind)
    try:
        data = msgspec.json.decode(text)
        if LOST in text:
            refuse_lost(data, f"{kind.name} {path}", kind)
    except (msgspec.DecodeError, RecursionError) as error:
        raise kind.error(f"{kind.name} {path} is not valid JSON: {error}; {kind.remedy}") from error
    return data


def refuse_lost(data: Any, where: str, kind: TextKind, key: str = "") -> None:
    """Check that no name in plain data has lost letters to another encoding; free text may have.

    Args:
        data: content of a file, or of a part of it.
        where: kind and path of the file, for messages.
        kind: of the file.
        key: under which the data stands.

    Raises:
        TrackerError: of the kind's type; a key, or text under a key that is not known to be free, has `LOST`.
    """
    if isinstance(data, dict):
        for inner, value in data.items():
            refuse_lost(str(inner), where, kind)
            refuse_lost(value, where, kind, str(inner))
    elif isinstance(data, list):
        for value in data:
            refuse_lost(value, where, kind, key)
    elif isinstance(data, str) and LOST in data and not _FREE.search(key):
        raise kind.error(
            f"{where}: expected UTF-8 text in names, found {data[:60]!r}{f' as {key!r}' * bool(key)}, where "
            f"{LOST} stands for bytes of another encoding; save the file as UTF-8"
        )


def _encoding_of(start: bytes) -> str:
    """Return the encoding of a text by its byte order mark; UTF-8 without one.

    Raises:
        ValueError: every second byte is zero, as in UTF-16 without a mark.
    """
    for mark, encoding in BYTE_ORDER_MARKS:
        if start.startswith(mark):
            return encoding[: len("utf-16")]  # without the order, by which the mark is left out
    if len(start) >= 4 and (start[0] == start[2] == 0 or start[1] == start[3] == 0) and any(start[:4]):
        raise ValueError("zero bytes, as in UTF-16 without a byte order mark: save it as UTF-8")
    return "utf-8-sig"


def _open(path: Path) -> BufferedReader:
    """Open a regular file, or a pipe that a shell has opened, as in `--calibration <(command)`: that one has a writer.

    Raises:
        OSError: it is neither, or cannot be read.
    """
    return path.open("rb") if system.PIPE_OF_SHELL.fullmatch(str(path)) else open_regular(path)


@contextmanager
def _reading(path: Path, kind: TextKind) -> Generator[None, None, None]:
    """Raise the kind's error for what goes wrong while a file is read."""
    if "\0" in str(path):
        raise kind.error(f"{kind.name} {path} cannot be read: expected a path without null bytes, found one; check it")
    try:
        yield
    except FileNotFoundError as error:
        raise kind.error(f"{kind.name} {path} not found; check the path") from error
    except OSError as error:
        raise kind.error(f"{kind.name} {path} cannot be read: {error.strerror or error}; {kind.remedy}") from error
    except ValueError as error:  # wrong UTF-8, too
        raise kind.error(
            f"{kind.name} {path} cannot be read: expected UTF-8 text, found: {error}; {kind.remedy}"
        ) from error


def _check_size(n_bytes: int, path: Path, kind: TextKind) -> None:
    if n_bytes > kind.max_bytes:
        raise kind.error(
            f"{kind.name} {path}: expected at most {kind.max_bytes / 10**6:g} MB, found more; check that it is the "
            "right file"
        )


# Strings and comments; one that is left open goes on to the end of its line or of the text.
_OPAQUE = re.compile(
    r""""{3}(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\Z)|'{3}(?:[^']|'(?!''))*+(?:'{3,5}|\Z)"""
    r"""|"(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?|#[^\n]*+""",
    re.DOTALL,
)
_LONG_KEY = re.compile(rf"(?:\.[ \t]*+[\w-]++[ \t]*+){{{MAX_NESTING}}}")
