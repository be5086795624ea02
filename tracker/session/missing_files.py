"""Files that session.toml names and that are not there. Opens none of them."""

from pathlib import Path
from typing import Literal, NamedTuple

from tracker.session.session import Session

Kind = Literal["footage", "background", "masks"]
KINDS: tuple[Kind, ...] = ("footage", "background", "masks")


class MissingFile(NamedTuple):
    """A file or folder that session.toml names and that is not there."""

    camera: str
    kind: Kind
    path: Path


def missing_files(session: Session) -> tuple[MissingFile, ...]:
    """Return what session.toml names and is not there, by camera."""
    found = []
    for source in session.cameras:
        for kind in KINDS:
            path: Path | None = getattr(source, kind)
            if path is not None and not path.exists():
                found.append(MissingFile(source.camera.name, kind, path))
    return tuple(found)
