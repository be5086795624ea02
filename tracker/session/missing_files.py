"""Files that session.toml names and that are not there. Opens none of them."""

from pathlib import Path
from typing import NamedTuple

from tracker.footage.camera_source import PathKind
from tracker.session.session import Session


class MissingFile(NamedTuple):
    """A file or folder that session.toml names and that is not there."""

    camera: str
    kind: PathKind
    path: Path


def missing_files(session: Session) -> tuple[MissingFile, ...]:
    """Return what session.toml names and is not there, by camera."""
    named = ((s.camera.name, kind, path) for s in session.cameras for kind, path in s.paths.items())
    return tuple(MissingFile(*found) for found in named if not found[-1].exists())
