"""The folder of a session: which one is meant, and whether it holds a session. Imports no reader of sessions."""

import os
from pathlib import Path

from tracker.errors import Remedy, SessionError

SESSION_FILE = "session.toml"


def session_folder(folder: str | Path) -> Path:
    """Return the folder of a session without detours.

    Raises:
        SessionError: it holds no session.
    """
    folder = tidy_path(Path(folder))
    if not os.path.isfile(folder / SESSION_FILE):  # unlike pathlib's, it is False for a name too long for the system
        raise SessionError(f"{folder} is not a session: expected {SESSION_FILE} in it", Remedy("make_session"))
    return folder


def tidy_path(path: Path) -> Path:
    """Make a path absolute and free of `..`, but keep links: a link to footage elsewhere must stay one."""
    return Path(os.path.abspath(path))
