"""Name files of other programs that are not read as calibrations, with advice."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from tracker.errors import CalibrationError
from tracker.formats.unread import begin_of, marks_of, unread

EXPECTED = "a calibration of a layout that docs/log/recordings.md lists"


def named(path: Path, found: str, advice: str) -> CalibrationError:
    """Return the error of a file that is not read."""
    return CalibrationError(f"calibration {path}: expected {EXPECTED}, found {found}; {advice}")


def name_binary(path: Path) -> None:
    """Name a file of another program that is no text; one that is missing is left to the reader of texts.

    Raises:
        CalibrationError: it is one.
    """
    rows, begin = unread("calibration") if path.is_file() else (), begin_of(path)
    by_name = [row for row in rows if path.suffix.lower() in row.suffixes]
    for row in (*(row for row in rows if row.begins(begin)), *by_name):
        raise named(path, row.program, row.instead)


def refuse_program(path: Path, data: Any) -> None:
    """Refuse data of programs that have words of cameras, and whose cameras cannot be read.

    Raises:
        CalibrationError: they are of one.
    """
    marks = marks_of(data) if isinstance(data, dict) else set()
    for row in unread("cameras"):
        if row.has_marks(marks):
            raise named(path, row.program, row.instead)


def foreign(path: Path, data: Any) -> CalibrationError:
    """Name the program that wrote data of no known layout."""
    marks = marks_of(data)
    for row in unread("layout"):
        if row.has_marks(marks):
            return named(path, row.program, row.instead)
    if isinstance(data, ElementTree.Element):
        return named(path, f"XML with <{data.tag[:40]}>", "export it in one of these layouts")
    if isinstance(data, str):
        found = "another kind of file" if data.strip() else "an empty file"
        return named(path, found, "export the calibration again")
    return named(path, "no camera", "export it in one of these layouts")
