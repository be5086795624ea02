"""Write text files atomically; read TOML files with errors that name the line."""

import contextlib
import os
import secrets
import tomllib
from pathlib import Path
from typing import Any

from tracker.errors import SessionError, TrackerError


def write_text_atomic(path: Path, text: str) -> None:
    """Write UTF-8 text to a temporary sibling, then rename it to `path`: a crash leaves the old file or the new one.

    Raises:
        OSError: the folder is missing or not writable, or the disk is full.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        with temporary.open("x", encoding="utf-8", newline="") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def refuse_links(folder: Path, *names: str) -> None:
    """Refuse to write files of a session through symbolic links, which may lead out of its folder.

    Args:
        folder: of the session; may be reached through links itself.
        names: paths within it of what is to be written; the folders on the way are checked too.

    Raises:
        SessionError: one of them is a link.
    """
    for name in names:
        path = folder
        for part in Path(name).parts:
            path = path / part
            if path.is_symlink():
                raise SessionError(
                    f"{path} is a symbolic link, and nothing is written through links inside a session; "
                    "put the file or folder itself there"
                )


def sync_folder(folder: Path) -> None:
    """Bring the names of new and renamed files of a folder to the disk, where the system can."""
    with contextlib.suppress(OSError):  # Windows cannot open folders
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def read_toml(path: Path, what: str, error_type: type[TrackerError]) -> dict[str, Any]:
    """Parse a TOML file.

    Args:
        path: the file.
        what: kind of file, for messages: `calibration`.
        error_type: kind of error to raise.

    Raises:
        TrackerError: of the given kind; the file is missing, unreadable, or not TOML (the message has the line).
    """
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError as error:
        raise error_type(f"{what} {path} not found; check the path") from error
    except (OSError, UnicodeDecodeError) as error:
        raise error_type(f"{what} {path} cannot be read as a UTF-8 text file: {error}") from error
    return parse_toml(text, f"{what} {path}", error_type)


def parse_toml(text: str, where: str, error_type: type[TrackerError]) -> dict[str, Any]:
    """Parse TOML text.

    Args:
        text: the text.
        where: its kind and source, for messages: `calibration lab.toml`.
        error_type: kind of error to raise.

    Raises:
        TrackerError: of the given kind; the text is not TOML (the message has the line).
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        # The parser gives no line for a construct left open at the end: report the last line.
        place = str(error).replace("at end of document", f"at line {max(1, len(text.splitlines()))}, the last")
        raise error_type(f"{where} is not valid TOML: {place}; correct it") from error
