"""Write files: text atomically, nothing through links, names on the disk."""

import contextlib
import os
import secrets
from pathlib import Path

from tracker.errors import SessionError


def write_text_atomic(path: Path, text: str, mode: int = 0o666) -> None:
    """Write UTF-8 text to a temporary sibling, then rename it to `path`: a crash leaves the old file or the new one.

    Args:
        path: the file.
        text: its content.
        mode: permissions, less those that the process masks; 0o600 for a file of this user alone.

    Raises:
        OSError: the folder is missing or not writable, or the disk is full.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        opened = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with open(opened, "w", encoding="utf-8", newline="") as file:
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
