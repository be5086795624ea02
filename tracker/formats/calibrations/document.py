"""Read a calibration file to plain data; its content shows the syntax, never its name.

Files of other programs that are not read as calibrations are named, with advice.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

from tracker.errors import CalibrationError
from tracker.formats.anipose import KIND
from tracker.formats.observation_layout import begin_of, marks_of, unread
from tracker.formats.plain_data import parse_json, parse_xml, parse_yaml, storage_data
from tracker.formats.text_files import parse_toml, read_text
from tracker.validation import quoted

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


def _by_marks(path: Path, kind: Literal["cameras", "layout"], data: Any) -> CalibrationError | None:
    """Return the error of data of a program that is known and not read; None if they are of none."""
    marks = marks_of(data)
    found = (named(path, row.program, row.instead) for row in unread(kind) if row.has_marks(marks))
    return next(found, None)


def refuse_program(path: Path, data: Any) -> None:
    """Refuse data of programs that have words of cameras, and whose cameras cannot be read.

    Raises:
        CalibrationError: they are of one.
    """
    if isinstance(data, dict) and (error := _by_marks(path, "cameras", data)):
        raise error


def foreign(path: Path, data: Any) -> CalibrationError:
    """Name the program that wrote data of no known layout."""
    if error := _by_marks(path, "layout", data):
        return error
    if isinstance(data, str):
        found = "another kind of file" if data.strip() else "an empty file"
        return named(path, found, "export the calibration again")
    found = f"XML with <{data.tag[:40]}>" if isinstance(data, ElementTree.Element) else "no camera"
    return named(path, found, "export it in one of these layouts")


_TOML_LINE = re.compile(r"\[{1,2}[^\[\]{}\n]+\]{1,2}\s*(#.*)?|[\w.\"'-]+\s*=.*")
_PARSERS = {"toml": parse_toml, "json": parse_json, "yaml": parse_yaml, "xml": parse_xml}
_YAML_LINE = re.compile(r"[^\s:,{}\[\]][^:,{}\[\]]*:(\s.*)?|- .*")


@dataclass(frozen=True, eq=False)
class Document:
    """One calibration file."""

    path: Path
    syntax: str
    """toml, json, yaml, xml or text."""
    data: Any
    """Dicts, lists, numbers and text; of XML that OpenCV has not written, its root element; of plain text the text."""

    @property
    def where(self) -> str:
        """Name of the file for messages."""
        return f"calibration {self.path}"

    @cached_property
    def groups(self) -> dict[str, dict[str, Any]]:
        """Groups at the top of the data by their keys; empty if it is no dict."""
        if not isinstance(self.data, dict):
            return {}
        return {str(key): value for key, value in self.data.items() if isinstance(value, dict)}

    @property
    def rows(self) -> list[tuple[str, dict[str, Any]]]:
        """Groups at the top, or dicts of a list, with their names; of a lone camera the file itself, without one."""
        if isinstance(self.data, list):
            return [(str(row.get("name", i)), row) for i, row in enumerate(self.data) if isinstance(row, dict)]
        return list(self.groups.items()) or ([("", self.data)] if isinstance(self.data, dict) else [])

    @property
    def stem(self) -> str:
        """Name of the file without what follows its first dot."""
        return self.path.name.partition(".")[0]


def at_top(*keys: str) -> Callable[[Document], bool]:
    """Return whether a file has all of some keys at its top."""
    return lambda document: isinstance(document.data, dict) and {*keys} <= document.data.keys()


def in_groups(*keys: str) -> Callable[[Document], bool]:
    """Return whether a group at the top of a file has all of some keys."""
    return lambda document: any({*keys} <= group.keys() for group in document.groups.values())


def in_rows(*keys: str) -> Callable[[Document], bool]:
    """Return whether a camera of a file, one of several or alone, has all of some keys."""
    return lambda document: any({*keys} <= row.keys() for _, row in document.rows)


def read_document(path: Path) -> Document:
    """Read a file.

    Raises:
        CalibrationError: it is missing, too large, no text, malformed, or of no known syntax.
    """
    name_binary(path)
    text = read_text(path, KIND)
    syntax = _syntax(text)
    data: Any = text if syntax is None else _PARSERS[syntax](text, str(path), KIND)
    if syntax == "xml" and data.tag == "opencv_storage":
        data = storage_data(data)
    return Document(path, syntax or "text", data)


def _syntax(text: str) -> str | None:
    """Return toml, json, yaml or xml by the first line that is no comment; None for anything else."""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("<"):
            return "xml"
        if line.startswith("%YAML") or line == "---":
            return "yaml"
        if not line or line.startswith("#"):
            continue
        if _TOML_LINE.fullmatch(line):
            return "toml"
        if line[0] in "[{":
            return "json"
        return "yaml" if _YAML_LINE.fullmatch(line) else None
    return None


def refuse(document: Document, camera: str | None, expected: str, found: str, advice: str) -> CalibrationError:
    """Return the error of a file, or of one camera in it."""
    place = document.where if camera is None else f"{document.where}, camera {quoted(camera)}"
    return CalibrationError(f"{place}: expected {expected}, found {found}; {advice}")


def numbers_in(text: str) -> list[float]:
    """Return the numbers of a text, apart by commas, semicolons or blanks; an empty list if a word is none."""
    text = text.replace(",", ".") if ";" in text else text  # decimal commas
    try:
        return [float(word) for word in re.findall(r"[^,;\s]+", text)]
    except ValueError:
        return []


def read_numbers(document: Document, camera: str, key: str, text: str | None, count: int) -> list[float]:
    """Return the numbers of a line or an attribute.

    Raises:
        CalibrationError: there are fewer or more.
    """
    if len(found := numbers_in(text or "")) != count:
        seen = "none" if text is None else text
        raise refuse(document, camera, f"{count} numbers as {key}", quoted(seen), "export the file again")
    return found
