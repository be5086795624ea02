"""Temporary folders of a running program. Making one removes the folders that killed programs left."""

import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from tracker import system
from tracker.errors import SessionError
from tracker.session.lock import LOCK_FILE, SessionLock

_PREFIX = "quadrille-"


class TemporaryFolder:
    """A folder that only this user may enter. It is locked while the program runs."""

    def __init__(self, parent: str) -> None:
        """Make it in a folder, such as that of the system for temporary files."""
        _remove_abandoned(Path(parent))
        self.path = Path(tempfile.mkdtemp(prefix=_PREFIX, dir=parent))
        self._lock = SessionLock(self.path)
        with suppress(SessionError):  # a disk without room: then only this program removes the folder
            self._lock.acquire()

    def close(self) -> None:
        """Delete it with its content."""
        self._lock.release()
        shutil.rmtree(self.path, ignore_errors=True)


def _remove_abandoned(parent: Path) -> None:
    for folder in parent.glob(f"{_PREFIX}*"):
        with suppress(OSError, SessionError):  # it is in use, or goes meanwhile
            is_one = folder.is_dir() and not folder.is_symlink() and (folder / LOCK_FILE).is_file()
            if is_one and system.is_mine(folder.lstat()):
                with SessionLock(folder):
                    shutil.rmtree(folder, ignore_errors=True)
