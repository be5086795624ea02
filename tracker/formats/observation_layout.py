"""One way in which programs write people whom they found: key points in pictures, masks, or joints in space."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, Generic, TypeVar

from tracker.errors import FormatError
from tracker.formats.number_rows import head_cells
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_json, read_lines

_TEXT = TextKind("file", TABLE_BYTES, FormatError)
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
            return tuple(islice(read_lines(self.path, _TEXT), _HEAD_LINES))
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
            return read_json(self.path, _TEXT)
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
