"""Keep the token of this user's starts, so that open tabs connect again after a restart."""

import os
import secrets
import stat
import time
from contextlib import suppress
from pathlib import Path

from tracker import system
from tracker.files import write_text_atomic

_NAME = "token"
_KEPT_S = 7 * 86400.0
"""Age from which a token is replaced."""
_MAX_BYTES = 200


def kept_token(folder: Path) -> str:
    """Return the token kept in a folder, or a new one, which is kept there.

    A file that another account may read, or that is not this user's, is replaced. If the folder cannot be written,
    the token holds for this start alone.

    Args:
        folder: private to this user; made where it is missing.
    """
    path = folder / _NAME
    token = _read(path)
    if token is None:
        token = secrets.token_urlsafe(32)
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_text_atomic(path, token, mode=0o600)
    return token


def _read(path: Path) -> str | None:
    """Return a token that only this user could have written and read, and that is not too old."""
    try:
        file = system.open_unlinked(path)
    except OSError:
        return None
    with os.fdopen(file, "rb") as opened:
        found = os.fstat(file)
        is_private = stat.S_ISREG(found.st_mode) and system.is_private(found)
        if not is_private or not 0 <= time.time() - found.st_mtime < _KEPT_S:
            return None
        text = opened.read(_MAX_BYTES).decode("ascii", "replace")
    return text if len(text) >= 43 and text.replace("-", "").replace("_", "").isalnum() and text.isascii() else None
