"""What is to be imported, and how."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tracker.session.clocks import Clock


@dataclass(frozen=True)
class ImportRequest:
    """Files to import, and choices of the user."""

    name: str
    """Name of the observations within the session."""
    paths: tuple[Path, ...]
    """Files and folders."""
    people: tuple[str, ...]
    """People of the session of whom they are."""
    joint_map: Path | None = None
    """File with the naming convention; guessed by default."""
    cameras: Mapping[str, Path] = field(default_factory=dict)
    """File or folder by camera, where names do not tell."""
    first_frame: int | None = None
    """Frame of the session of the first picture or row; None to go by the numbers of the file."""
    offsets: Mapping[str, int] = field(default_factory=dict)
    """Key points and masks: frames by which those of a camera are late, taken off; of a camera that is named, even by
    0, the user has decided."""
    clock: Clock | None = None
    """Points in space: whether rows lie at their numbers or at their times; see `Placement`."""
    axes: str = "x,y,z"
    """Points in space: axes of the file that are the session's x, y, z."""
    unit_m: float | None = None
    """Points in space: metres per unit of a file that states none."""
    confidence: float | None = None
    """Confidence of points in files without one."""
    picture_size: tuple[int, int] | None = None
    """Width and height of the pictures that points or masks are of, px; 1, 1 for normalized points."""
    masks: bool = False
    """Whether masks are taken where the files hold key points, too."""
    values: Mapping[str, int] = field(default_factory=dict)
    """Masks: value of a person's pixels, by name; all other values are anyone."""

    @property
    def options(self) -> tuple[tuple[str, str], ...]:
        """Names and values of the choices by which the files are read, to be stored."""
        found = {
            "first_frame": self.first_frame,
            "offsets": json.dumps(dict(self.offsets)) if self.offsets else None,
            "clock": self.clock,
            "axes": self.axes if self.axes != "x,y,z" else None,
            "unit_m": self.unit_m,
            "confidence": self.confidence,
            "picture_size": "x".join(map(str, self.picture_size)) if self.picture_size else None,
            "values": " ".join(f"{name}={value}" for name, value in self.values.items()) or None,
        }
        return tuple((key, str(value)) for key, value in found.items() if value is not None)


def picture_size(options: Iterable[tuple[str, str]]) -> tuple[int, int] | None:
    """Return the size of the pictures that files are of, px, if the options say that it is not that of the footage."""
    width, _, height = dict(options).get("picture_size", "").partition("x")
    return (int(width), int(height)) if width else None
