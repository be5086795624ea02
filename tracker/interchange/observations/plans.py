"""Requests to import files, masks as files have them, and imports that were read and checked and are not yet stored."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError, TrackerError
from tracker.footage.image_file import ANYONE, LabelImage
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.interchange.observations.observed import ObservationSet, SourceFile
from tracker.interchange.observations.sources import FileGroup
from tracker.session.row_placement import Clock

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
    """Points in space: whether rows lie at their numbers or at their times; see `RowPlacement`."""
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


@dataclass(frozen=True, eq=False)
class MaskFiles:
    """The masks of one camera."""

    group: FileGroup
    numbers: IntArray
    """Number of each picture in the files, (n,), ascending."""
    read: Callable[[int, tuple[int, int]], LabelImage]
    """Reads the mask of a picture, by its place in `numbers`, of a width and height. Raises TrackerError where it is
    damaged, malformed or of another size."""
    notes: tuple[str, ...] = ()
    """Sentences on what is odd about the files."""


@dataclass(frozen=True)
class MaskRules:
    """How values become people. All masks of an import have the same rules."""

    is_matte: bool = False
    """Whether values are opacities, of which the upper half is a person; else each value but 0 is one."""
    people: Mapping[int, int] | None = None
    """Number of a person in the session, from 1, or `UNKNOWN`, by label in the files; None if none is assigned."""

    def apply(self, labels: NDArray[Any]) -> NDArray[np.uint8]:
        """Return a mask as footage has it, (H, W); see `tracker.footage.recording.read_mask`."""
        out = np.where(_is_opaque(labels) if self.is_matte else labels > 0, ANYONE, 0).astype(np.uint8)
        for value, number in (self.people or {}).items():
            out[labels == value] = number
        return out


@dataclass(frozen=True, eq=False)
class MaskSurvey:
    """The content of all masks of a camera."""

    shares: Array
    """Share of each picture that is neither 0 nor unknown, (n,)."""
    opaque_shares: Array
    """Share of each picture that is in the upper half of its values, (n,)."""
    values: frozenset[int]
    """All values but 0."""
    is_alpha: Mask
    """Whether each mask is the opacity of a picture, (n,)."""

    def shares_by(self, rules: MaskRules) -> Array:
        """Return the share of each picture that people cover, (n,)."""
        return self.opaque_shares if rules.is_matte else self.shares


def survey(masks: MaskFiles, size: tuple[int, int], unknown: int = 0) -> MaskSurvey:
    """Read all masks of a camera.

    Args:
        masks: the masks.
        size: width and height that they must have, px.
        unknown: value of pixels that may be of people, which do not count as theirs; 0 for none.

    Raises:
        TrackerError: one is damaged, malformed or of another size.
    """
    n = len(masks.numbers)
    shares, values, is_alpha = np.empty((2, n)), set[int](), np.empty(n, dtype=bool)
    for i in range(n):
        image = masks.read(i, size)
        is_person = (image.labels > 0) & (image.labels != unknown)
        shares[:, i] = is_person.mean(), _is_opaque(image.labels).mean()
        values |= {*np.flatnonzero(np.bincount(image.labels.ravel())).tolist()}
        is_alpha[i] = image.is_alpha
    return MaskSurvey(shares[0], shares[1], frozenset(values - {0}), is_alpha)


def _is_opaque(labels: NDArray[Any]) -> Mask:
    return np.asarray(labels > np.iinfo(labels.dtype).max // 2)


@dataclass(frozen=True)
class ViewPreview:
    """The part of an import that is of one camera, or of one file of points in space."""

    camera: str
    """Name of the camera; the person for points in space."""
    place: Path | None
    """The file or folder; None for a camera without one."""
    n_rows: int = 0
    """Number of pictures or rows."""
    frames: tuple[int, int] | None = None
    """First and last frame of the session with points; None without points."""
    n_people: int = 0
    """Most people in a picture."""
    confidence: float = np.nan
    """Median confidence of the points found; NaN if unknown."""
    share: float = np.nan
    """Masks: median share of the picture that people cover, of pictures with anyone; NaN for points."""


@dataclass(frozen=True, eq=False)
class ImportPlan:
    """An import of key points or joints."""

    observations: ObservationSet
    files: Mapping[str, Path]
    """The file of each source, by its path within the observations."""
    views: tuple[ViewPreview, ...]
    problems: tuple[FormatError, ...]
    """Contradictions to the session; with any, it cannot be stored."""


@dataclass(frozen=True, eq=False)
class MaskPlan:
    """An import of masks."""

    name: str
    """Name within the session."""
    format: str
    """Name of the format of the files, one of `tracker.interchange.observations.readers.FORMATS`."""
    masks: Mapping[str, MaskFiles]
    """The masks of each camera."""
    pictures: Mapping[str, IntArray]
    """By camera, the picture of the footage that each mask is of, (n,); -1 for one that is left out."""
    rules: MaskRules
    """How their values are read."""
    sources: tuple[SourceFile, ...]
    files: Mapping[str, Path]
    """The file of each source, by its path."""
    notes: tuple[str, ...]
    """Sentences on what was remarkable in the files."""
    options: tuple[tuple[str, str], ...]
    """Names and values of the choices by which the files were read."""
    views: tuple[ViewPreview, ...]
    problems: tuple[TrackerError, ...]
    """Contradictions to the session; with any, it cannot be stored."""

    def mask(self, camera: str, i: int, size: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the mask at a place in the files of a camera as footage has it, (H, W): 0 background, k person k.

        Args:
            camera: its name.
            i: the place.
            size: width and height of the camera, px.

        Raises:
            TrackerError: the file is damaged, or has changed.
        """
        written = picture_size(self.options) or size
        mask = self.rules.apply(self.masks[camera].read(i, written).labels)
        if written == size:
            return mask
        return np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST_EXACT), dtype=np.uint8)
