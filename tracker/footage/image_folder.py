"""A folder of images as the footage of one camera."""

import re
from collections import Counter
from collections.abc import Sequence
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from tracker.errors import RecordingError
from tracker.files import paths_in
from tracker.footage.image_file import IMAGE_SUFFIXES, read_image, read_image_or_none
from tracker.footage.picture_numbers import PictureNumbers, picture_numbers
from tracker.geometry.arrays import Image, IntArray


class ImageFolder:
    """A folder of images of one kind, in the order of their numbers or times, else of their names (2 before 10)."""

    path: Path
    size: tuple[int, int]
    """Width and height, px."""
    n_frames: int
    files: list[Path]
    """The images, in order."""
    named: PictureNumbers
    """Numbers and times in the names of the images, in their order."""
    is_mirrored: bool = False
    fps: None = None
    """Images have no frame rate."""
    has_constant_rate: bool = True
    stamps: None = None
    """Images have no time stamps."""
    listed_share: None = None
    version: int = 0
    """Images are read again each time; a folder has one version."""

    def __init__(self, path: Path, camera: str) -> None:
        """List the images and read the first.

        Args:
            path: the folder.
            camera: name of its camera, for messages.

        Raises:
            RecordingError: no images, images of several kinds, or the first is unreadable.
        """
        self.path = path
        self._where = f"camera '{camera}': image folder {path}"
        images = paths_in(path, RecordingError, lambda name: name.lower().endswith(IMAGE_SUFFIXES))
        kinds = sorted({f.suffix.lower() for f in images})
        if len(kinds) != 1:
            raise RecordingError(
                f"{self._where}: expected images of one kind ({', '.join(IMAGE_SUFFIXES)}), "
                f"found {' and '.join(kinds) or 'none'}; leave only the frames of this camera in it"
            )
        self.files = sorted(images, key=natural_order)
        self.n_frames = len(self.files)
        self.named = picture_numbers([f.stem for f in self.files])
        places = self.named.numbers or self.named.times
        if places is not None:
            self.files = [self.files[i] for i in np.argsort(places, kind="stable")]
            self.named = picture_numbers([f.stem for f in self.files])
        height, width = read_image(self.files[0], self._where).shape[:2]
        self.size = (width, height)

    @property
    def numbers(self) -> tuple[int, ...] | None:
        """Number of each image according to its name; None if the names do not show it, and of a lone image."""
        return self.named.numbers if self.n_frames > 1 else None

    @property
    def key_frames(self) -> IntArray:
        """Frames that are decoded alone, ascending, (n,): all."""
        return np.arange(self.n_frames)

    def read(self, k: int) -> Image | None:
        """Decode frame k, (H, W, 3) RGB; None if the image is damaged.

        Raises:
            RecordingError: k is out of range, or the folder or the image is missing, or the image is of another size.
        """
        if not 0 <= k < self.n_frames:
            raise RecordingError(f"{self._where}: expected a frame from 0 to {self.n_frames - 1}, found {k}")
        self.look_again()  # one message for all frames
        image = read_image_or_none(self.files[k], self._where)
        if image is not None and image.shape[1::-1] != self.size:
            raise RecordingError(
                f"{self._where}: expected {self.size[0]}x{self.size[1]} pixels as in the first image, found "
                f"{image.shape[1]}x{image.shape[0]} in {self.files[k].name}; give all images one size"
            )
        return image

    def look_again(self) -> None:
        """Check that the folder is there.

        Raises:
            RecordingError: it is missing.
        """
        if not self.path.is_dir():
            raise RecordingError(f"{self._where} is not there any more; put it back")

    def close(self) -> None:
        """Do nothing: no file stays open."""


def missing_numbers(numbers: Sequence[int], at_most: int = 5) -> list[int]:
    """Return the first few numbers that a numbered folder leaves out; the usual step may be more than 1."""
    steps = Counter(b - a for a, b in pairwise(numbers))
    step = max(1, steps.most_common(1)[0][0]) if steps else 1
    gaps = (n for a, b in pairwise(numbers) for n in range(a + step, b, step))
    return list(islice(gaps, at_most))


def natural_order(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key that compares runs of digits as numbers."""
    return [(0, int(t)) if t.isdecimal() else (1, t) for t in re.split(r"(\d+)", path.name) if t]
