"""Where the page's files are."""

from pathlib import Path

from tracker.errors import TrackerError


def static_folder() -> Path:
    """Return the folder of the page: inside the installed package, or beside it in a checkout."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "static", here.parent / "static"):
        if (folder / "index.html").is_file():
            return folder
    raise TrackerError(f"expected the page's files in '{here / 'static'}', found none; install quadrille again")
