"""Write reports: tables, and HTML files that need no other."""

import html
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tracker.errors import TrackerError
from tracker.files import write_text_atomic

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 75rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; } td, th { padding: .2rem .8rem .2rem 0; text-align: left; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
"""


def write_html(path: Path, title: str, body: Sequence[str], style: str) -> None:
    """Write a report; the file appears complete or not at all. Raises as `write_text` does.

    Args:
        path: the file.
        title: plain text.
        body: elements of the page, with all text escaped.
        style: rules beside those of all reports.
    """
    write_text(
        path,
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}{style}</style><body>{''.join(body)}</body></html>",
    )


def write_text(path: Path, text: str) -> None:
    """Write a text; the file appears complete or not at all.

    Raises:
        TrackerError: it cannot be written.
    """
    with writing(path):
        write_text_atomic(path, text)


@contextmanager
def writing(path: Path) -> Generator[None, None, None]:
    """Say why a file cannot be written.

    Raises:
        TrackerError: it cannot.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise TrackerError(
            f"cannot write {path}: {reason}; choose a folder that you may write to, with room"
        ) from error
