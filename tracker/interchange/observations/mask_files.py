"""Masks of one camera, as the files of another program have them, and how their values are read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.footage.image_file import ANYONE, LabelImage
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.interchange.observations.sources import FileGroup


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
