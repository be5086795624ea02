"""Folders of the user for what the program keeps between starts."""

from pathlib import Path

from platformdirs import user_cache_path


def frame_index_folder() -> Path:
    """Return the folder that stores the frame indices of videos."""
    return user_cache_path("quadrille", appauthor=False) / "footage"
