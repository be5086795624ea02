"""A detector of people in a picture, and what it finds. Its networks know nothing of other views and frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array, Image


class _Adult(NamedTuple):
    """The person in whose sizes squares are given, metres."""

    square_m: float
    """Side of the square around the hips in which a detector looks for the person's points."""
    leg_m: float
    """From hip to ankle."""


ADULT = _Adult(2.4, 0.88)
"""Someone 1.8 m tall, whose hips are at 0.53 and whose ankles are at 0.039 of the stature (R. Drillis and R. Contini
1966). The square is 1.25 times (BlazePose's model card) the circle through the soles."""


class SquareImage(NamedTuple):
    """An image of a square of a picture."""

    image: NDArray[np.uint8]
    to_picture: Array
    """Maps its pixels to those of the picture, (2, 3)."""

    def in_picture(self, points_px: Array) -> Array:
        """Return the pixels of the picture at pixels of the image, (..., 2)."""
        return points_px @ self.to_picture[:, :2].T + self.to_picture[:, 2]


class PictureSquare(NamedTuple):
    """A square of a picture, turned so that a person in it stands upright."""

    center_px: Array
    """Center, (2,), px; a pixel's center is at whole numbers."""
    side_px: float
    """Side, px."""
    turn_rad: float = 0.0
    """Angle from the picture's upward direction to the square's, clockwise, radians."""

    def to_pixels(self, size: int) -> Array:
        """Return the map from the picture to an image of the square, (2, 3), of a size in px."""
        cosine, sine = np.cos(self.turn_rad), np.sin(self.turn_rad)
        A = size / self.side_px * np.array([[cosine, sine], [-sine, cosine]])
        return np.column_stack([A, (size - 1) / 2 - A @ self.center_px])

    def crop(self, picture: Image, width: int, height: int, **border: Any) -> SquareImage:
        """Return an image of a size that shows the square whole; `border` says how `cv2.warpAffine` goes beyond."""
        side = max(width, height)
        to_pixels = self.to_pixels(side)
        to_pixels[:, 2] += (width - side) / 2, (height - side) / 2
        image = cv2.warpAffine(picture, to_pixels, (width, height), **border)
        return SquareImage(np.asarray(image, np.uint8), np.asarray(cv2.invertAffineTransform(to_pixels), np.float64))


@dataclass(frozen=True, eq=False)
class DetectedPerson:
    """A person whom a detector sees in a picture."""

    points_px: Array
    """Points in the order of the detector's skeleton, (N, 2), px of the picture; NaN where unknown."""
    confidence: Array
    """Of each, (N,), 0 to 1."""
    presence: float
    """Probability that there is a person, 0 to 1."""
    mask: Callable[[tuple[int, int]], NDArray[np.float32]] | None = None
    """Returns the probability that each pixel of the picture, whose height and width it is given, shows the person."""
    colors: Array | None = None
    """Of the clothes, (6,), see `tracker.interchange.detection.people_in_views`; a detector need not give them."""


class Detector(Protocol):
    """Finds people in a picture, and their points."""

    skeleton: str
    """Name of the convention of the points, one of `tracker.formats.joint_maps.known_joint_maps`."""

    def find(self, picture: Image, square: PictureSquare) -> Sequence[PictureSquare]:
        """Return the squares around the people in a part of a picture, (H, W, 3) RGB, the most certain first."""

    def look(self, picture: Image, square: PictureSquare) -> DetectedPerson | None:
        """Return the person around whom a square of a picture, (H, W, 3) RGB, lies; None if there is nobody."""


class DetectorKind(NamedTuple):
    """A detector before its networks are loaded: what the entry points of `quadrille.detectors` name."""

    name: str
    help: str
    """A sentence on it, with its license and what it needs."""
    models: tuple[str, ...]
    """Names of its models, from the quickest to the most accurate; empty if a file is the model."""
    load: Callable[[str, Path], Detector]
    """Loads a model by its name, or its file, from a folder of models."""
