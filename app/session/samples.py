"""Find the bundled samples, and make working copies of them."""

import shutil
from collections.abc import Iterable
from pathlib import Path

from platformdirs import user_data_path

from tracker.errors import SessionError
from tracker.session.folder import SESSION_FILE
from tracker.session.lock import SessionLock

DEFAULT_SAMPLE = "tango"


def sample_copy(name: str = DEFAULT_SAMPLE, afresh: bool = False) -> Path:
    """Return the working copy of a bundled sample in the user's data folder; makes it if it is missing.

    Args:
        name: of the sample.
        afresh: replace the working copy.

    Raises:
        SessionError: the sample is unknown, or the copy is open in another program.
    """
    source = bundled(name)
    copy = user_data_path("quadrille", appauthor=False) / "samples" / name
    if afresh and copy.exists():
        with SessionLock(copy):
            pass  # not open in another program
        shutil.rmtree(copy)
    if not copy.exists():
        unfinished = copy.with_name(f".{name}.unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        shutil.copytree(source, unfinished)
        for path in (unfinished, *unfinished.rglob("*")):  # a read-only install gives read-only copies
            path.chmod(path.stat().st_mode | 0o200)
        unfinished.rename(copy)
    return copy


def bundled(name: str) -> Path:
    """Return the folder of a bundled sample, which may be read-only.

    Raises:
        SessionError: the sample is unknown.
    """
    source = _folder() / name
    if not (source / SESSION_FILE).is_file():
        raise SessionError(f"expected one of the samples {', '.join(samples())}, found '{name}'")
    return source


def samples() -> Iterable[str]:
    """Return the names of the bundled samples."""
    return sorted(p.parent.name for p in _folder().glob(f"*/{SESSION_FILE}"))


def _folder() -> Path:
    here = Path(__file__).resolve().parents[1]
    installed = here / "sample_sessions"
    return installed if installed.is_dir() else here.parent / "sample_sessions"
