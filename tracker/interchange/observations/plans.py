"""Imports that have been read and checked, and are not yet stored."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError, TrackerError
from tracker.geometry.arrays import IntArray
from tracker.interchange.observations.mask_files import MaskFiles, MaskRules
from tracker.interchange.observations.observed import ObservationSet, SourceFile
from tracker.interchange.observations.request import picture_size


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
