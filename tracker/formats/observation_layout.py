"""One way in which programs write people whom they found, and files that are known and not read.

Such a file has a row in `unread.toml`, with what to do instead.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fnmatch import filter as matching
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar
from xml.etree import ElementTree

import msgspec

from tracker.errors import FormatError
from tracker.files import open_regular
from tracker.formats import text_files
from tracker.formats.number_rows import head_cells

_TEXT = text_files.TextKind("file", text_files.TABLE_BYTES, FormatError)
_HEAD_LINES = 12
"""Lines in which all known tables have shown their columns: the header of a C3D export by QTM takes 10."""
T = TypeVar("T")


@dataclass(frozen=True)
class Sample:
    """A file of an import, looked at to tell which program wrote it. Nothing is read twice."""

    path: Path

    @property
    def suffix(self) -> str:
        """End of its name, in lower case: `.json`."""
        return self.path.suffix.lower()

    @cached_property
    def head(self) -> tuple[str, ...]:
        """First lines, without their ends; none if the file is no text."""
        try:
            return tuple(islice(text_files.read_lines(self.path, _TEXT), _HEAD_LINES))
        except FormatError:
            return ()

    @cached_property
    def cells(self) -> list[list[str]]:
        """Cells of the first lines of a delimited table that are not blank."""
        return head_cells(self.head)

    @cached_property
    def data(self) -> Any:
        """Plain data of a JSON file; None if it is none."""
        try:
            return text_files.read_json(self.path, _TEXT)
        except FormatError:
            return None


@dataclass(frozen=True)
class ObservationLayout(Generic[T]):
    """One way in which programs write people whom they found."""

    program: str
    """Programs that write it, for messages and documents: `Lightning Pose, EKS`."""
    files: str
    """Files of an import, for documents: `a .csv for each camera`."""
    recognized_by: str
    """Content by which it is recognized, for documents."""
    recognizes: Callable[[Sample], bool]
    read: Callable[..., T]
    """Reads files; the arguments are those of its table."""
    patch: Callable[..., bytes] | None = None
    """Returns a file with points replaced, to be sent back; None for a layout that is read only."""


class UnsupportedLayout(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A kind of file that is not read."""

    program: str
    """Its name for messages and documents: `a MATLAB file`."""
    instead: str
    """Advice to the person who has it, as the end of a sentence."""
    suffixes: tuple[str, ...] = ()
    """Ends of its name, in lower case."""
    first: str = ""
    """Its first bytes, as Latin-1; empty if they tell nothing."""
    holds: str = ""
    """Text near its beginning; empty if it needs none."""
    marks: tuple[str, ...] = ()
    """All of these are among the marks of its data, see `marks_of`; empty if they tell nothing."""
    recognized_by: str = ""
    """Content by which it is recognized, for documents."""

    @property
    def files(self) -> str:
        """Ends of its files' names, for documents."""
        return ", ".join(f"`{suffix}`" for suffix in self.suffixes) or "`.json`"

    def recognizes(self, sample: Sample) -> bool:
        """Return whether a file of an import is one."""
        has_name = sample.suffix in self.suffixes or (bool(self.first) and self.begins(begin_of(sample.path)))
        return has_name or (bool(self.marks) and sample.suffix == ".json" and self.has_marks(marks_of(sample.data)))

    def begins(self, begin: bytes) -> bool:
        """Return whether a file has its first bytes."""
        return bool(self.first) and begin.startswith(self.first.encode("latin-1")) and self.holds.encode() in begin

    def has_marks(self, marks: set[str]) -> bool:
        """Return whether data with some marks are its."""
        return bool(self.marks) and all(pattern in marks or matching(marks, pattern) for pattern in self.marks)


_KIND = text_files.TextKind("table of programs", text_files.DOCUMENT_BYTES, FormatError)
_ROWS: Mapping[str, tuple[UnsupportedLayout, ...]] = msgspec.convert(
    text_files.parse_toml(text_files.packaged_texts("formats")["unread"], "unread.toml", _KIND),
    dict[str, tuple[UnsupportedLayout, ...]],
)


def unread(kind: Literal["calibration", "cameras", "layout", "joints", "points"]) -> tuple[UnsupportedLayout, ...]:
    """Return the files of a kind in the order in which they are tried."""
    return _ROWS[kind]


def begin_of(path: Path) -> bytes:
    """Return the first bytes of a file; none if it cannot be read."""
    try:
        with open_regular(path) as file:
            return file.read(1000)
    except OSError:
        return b""


def marks_of(data: Any) -> set[str]:
    """Return the keys and tags by which programs are known from plain data or XML, as `unread.toml` writes them."""
    if isinstance(data, ElementTree.Element):
        tag = f"<{data.tag.lower()}>"
        return {tag, *(f"{tag}.<{child.tag.lower()}>" for child in data)}
    if isinstance(data, list):
        inner = data[0] if data else None
        depth = isinstance(inner, list) and bool(inner) and isinstance(inner[0], list)
        return {f"first.{key}" for key in inner} if isinstance(inner, dict) else {"[[["} if depth else set()
    if not isinstance(data, dict):
        return set()
    first = next(iter(data.values()), None)
    of_lists = {
        f"{name}.{key}"
        for name, items in data.items()
        if isinstance(items, list)
        for item in items
        if isinstance(item, dict)
        for key in item
    }
    return {*map(str, data)} | of_lists | ({f"first.{key}" for key in first} if isinstance(first, dict) else set())
