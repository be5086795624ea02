"""The folder of a session: which one is meant, whether it holds a session, and how one appears. Imports no reader of
sessions."""

import os
import secrets
import shutil
from collections.abc import Generator
from contextlib import contextmanager
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


def require_free(folder: Path) -> None:
    """Check that a session can appear at a folder: it does not exist, or is empty.

    Raises:
        SessionError: it is in use.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise SessionError(f"{folder} exists already and is not an empty folder; choose another name or remove it")


@contextmanager
def appearing(folder: Path) -> Generator[Path, None, None]:
    """Yield a folder beside another one, which it becomes at the end of the `with` block.

    Raises:
        SessionError: it cannot be written.
    """
    temporary = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.tmp")
    try:
        temporary.mkdir(parents=True)
        yield temporary
        if folder.exists():
            folder.rmdir()
        temporary.rename(folder)
    except OSError as error:
        raise SessionError(f"cannot write the session {folder}: {error}; choose a folder you may write to") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
