"""The folder of this machine in which the lists of the frames of videos are cached."""

from pathlib import Path

from platformdirs import user_cache_path


def footage_indices() -> Path:
    """Return the folder that stores the frame indices of videos between openings."""
    return user_cache_path("quadrille", appauthor=False) / "footage"
