"""A format that a session is exported to: how its files are named and written, and what they can hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import AxesName, ExportedMotion, ExportOptions, UnitName

Tick = Callable[[], None]
"""Called after each frame of each file; it may raise to stop the export."""
Writer = Callable[["ExportedMotion", "ExportOptions", Sequence[Path], Tick], None]
"""Writes a motion to the files of one format, and calls the function after each frame."""


@dataclass(frozen=True)
class ExportFormat:
    """A format that a session is exported to."""

    name: str
    """By which the command line and the page refer to it."""
    title: str
    """Its content, for people."""
    suffixes: tuple[str, ...]
    """End of the name of each file; the first names the format."""
    write: Writer
    options: frozenset[str] = frozenset()
    """Options that it has, some of `OPTIONS`."""
    one_person: bool = False
    """Whether each person gets files of their own."""
    axes: "AxesName" = "calibration"
    """Axes by default, as programs that read it expect them."""
    units: "UnitName" = "m"
    """Unit of lengths by default."""
    gaps: str = "left empty"
    """Treatment of frames without a pose."""
    numbering: str = ""
    """Sentence on its frame numbers where they are not the session's, of `{frame}` and `{number}`, 1 more."""
    one_body: bool = False
    """Whether all poses of a person are of one body; those of earlier sizes are refitted."""
    has_rate: bool = False
    """Whether its frames have a constant rate; those between the exported ones are then like frames without a pose."""
    is_folder: bool = False
    """Whether it is a folder of files; the first suffix ends its name if it is named after the session."""
    holds_provenance: bool = False
    """Whether its own files hold the provenance of the poses."""
