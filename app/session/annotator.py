"""Remember the person who annotates on this account, for all commands that write."""

import getpass
import os
from contextlib import suppress
from pathlib import Path

from platformdirs import user_state_path

from tracker.errors import TrackerError
from tracker.files import write_text_atomic
from tracker.session.store.annotator import VARIABLE, annotator, checked_annotator


def set_annotator(name: str | None) -> None:
    """Name the annotator of this process and of the processes that it starts, and remember the name.

    Args:
        name: that a command was given; None leaves the environment variable, then the name remembered last.

    Raises:
        TrackerError: it is no name.
    """
    if name is None:
        if not os.environ.get(VARIABLE):
            with suppress(OSError, UnicodeDecodeError, TrackerError):
                os.environ[VARIABLE] = checked_annotator(_file().read_text("utf-8").strip())
        return
    os.environ[VARIABLE] = name = checked_annotator(name)
    with suppress(OSError):  # where nothing can be remembered, the name holds for this process
        _file().parent.mkdir(parents=True, exist_ok=True)
        write_text_atomic(_file(), f"{name}\n")


def annotator_or_login() -> str:
    """Return the name of the annotator; by default the user of this machine, or empty if unknown."""
    try:
        return annotator() or getpass.getuser()
    except (KeyError, OSError):  # a container's user may have no name
        return ""


def _file() -> Path:
    """Return the file that keeps the name."""
    return user_state_path("quadrille", appauthor=False) / "annotator"
