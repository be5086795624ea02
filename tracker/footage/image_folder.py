"""A folder of images as the footage of one camera."""

import re
from pathlib import Path

from tracker.errors import RecordingError
from tracker.footage.image_file import IMAGE_SUFFIXES, read_image, read_image_or_none
from tracker.geometry.arrays import Image


class ImageFolder:
    """A folder of images of one kind, in the natural order of their names (2 before 10)."""

    path: Path
    size: tuple[int, int]
    """Width and height, px."""
    n_frames: int
    files: list[Path]
    """The images, in order."""
    fps: None = None
    """Images have no frame rate."""
    has_constant_rate: bool = True
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
        images = [f for f in path.iterdir() if f.suffix.lower() in IMAGE_SUFFIXES and not f.name.startswith(".")]
        kinds = sorted({f.suffix.lower() for f in images})
        if len(kinds) != 1:
            raise RecordingError(
                f"{self._where}: expected images of one kind ({', '.join(IMAGE_SUFFIXES)}), "
                f"found {' and '.join(kinds) or 'none'}; leave only the frames of this camera in it"
            )
        self.files = sorted(images, key=_natural)
        self.n_frames = len(self.files)
        height, width = read_image(self.files[0], self._where).shape[:2]
        self.size = (width, height)

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


def _natural(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key that compares runs of digits as numbers."""
    return [(0, int(t)) if t.isdigit() else (1, t) for t in re.split(r"(\d+)", path.name) if t]
