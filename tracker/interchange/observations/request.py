"""What is to be imported, and how."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from tracker.errors import FormatError
from tracker.session.clocks import Clock

Content = Literal["key points", "masks", "joints"]
"""Content of the files of an import."""


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
    unusual: bool = False
    """Whether points that are implausible for a person of the recording are stored all the same."""
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
            "unusual": self.unusual or None,
            "picture_size": "x".join(map(str, self.picture_size)) if self.picture_size else None,
            "values": " ".join(f"{name}={value}" for name, value in self.values.items()) or None,
        }
        return tuple((key, str(value)) for key, value in found.items() if value is not None)


_CHOICES: dict[str, tuple[str, str, tuple[Content, ...]]] = {
    "offsets": ("offsets", "key points or masks, whose views may be late", ("key points", "masks")),
    "cameras": ("cameras", "key points or masks of each camera", ("key points", "masks")),
    "picture_size": ("size of pictures", "key points or masks in pixels", ("key points", "masks")),
    "confidence": ("confidence", "key points, which have a confidence", ("key points",)),
    "values": ("values", "masks, whose values tell people apart", ("masks",)),
    "clock": ("clock", "joints, whose rows may have times", ("joints",)),
    "axes": ("axes", "joints, which have axes", ("joints",)),
    "unit_m": ("unit", "joints, which have a unit", ("joints",)),
}
"""Choices that count for some contents alone: their name, what they are for, and the contents."""


def refuse_choices(request: ImportRequest, content: Content) -> None:
    """Refuse choices that do not count for the content of the files: they would be left out without a word.

    Raises:
        FormatError: there is such a choice.
    """
    plain = ImportRequest(request.name, request.paths, request.people)
    for field_name, (name, expected, contents) in _CHOICES.items():
        if content not in contents and getattr(request, field_name) != getattr(plain, field_name):
            found = " or ".join(c for c in get_args(Content) if c not in contents)
            raise FormatError(f"expected {expected}, found {found}; give no {name}")


def picture_size(options: Iterable[tuple[str, str]]) -> tuple[int, int] | None:
    """Return the size of the pictures that files are of, px, if the options say that it is not that of the footage."""
    width, _, height = dict(options).get("picture_size", "").partition("x")
    return (int(width), int(height)) if width else None
