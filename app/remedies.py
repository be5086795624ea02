"""The remedies of the library's errors and warnings, in the words of the command line and of the page.

`remedies.toml` has one table for each code of a `tracker.errors.Remedy`.
"""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tracker.compute.installed_package import install_command
from tracker.errors import Remedy, TrackerError


class Phrases(NamedTuple):
    """Ends of a sentence that name the remedy, one for each program."""

    command_line: str
    page: str


@cache
def phrases() -> Mapping[str, Phrases]:
    """Return the phrases by code."""
    text = (Path(__file__).parent / "remedies.toml").read_text("utf-8")
    return {code: Phrases(**fields) for code, fields in tomllib.loads(text).items()}


def command_line_text(text: object, remedy: Remedy | None = None) -> str:
    """Return an error, or a warning with its remedy, in the words of the command line."""
    return _sentence(text, remedy, 0)


def page_text(text: object, remedy: Remedy | None = None) -> str:
    """Return an error, or a warning with its remedy, in the words of the page."""
    return _sentence(text, remedy, 1)


def page_sentence(text: object) -> str:
    """Return an error as a sentence of the page; empty if there is none."""
    words = page_text(text)
    return f"{words[:1].upper()}{words[1:]}." if words else ""


def _sentence(text: object, remedy: Remedy | None, column: int) -> str:
    if isinstance(text, TrackerError):
        remedy = remedy or text.remedy
    if remedy is None:
        return str(text)
    fields = {k: install_command(str(v)) if k == "extra" else v for k, v in remedy.fields.items()}
    return f"{text}; {phrases()[remedy.code][column].format(**fields)}"
