"""Write pictures as an animation that plays in documents and messages: GIF or animated WebP."""

from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.footage.recording import DEFAULT_CACHE_BYTES

MAX_WIDTH_PX = 640
"""Width of the picture, px, at most: the text column of a web page has some 700."""
_TICK_MS = 10
"""Unit of the delays of GIF, ms. Viewers slow down a picture that is shown for one tick alone."""


class AnimationWriter:
    """A file that takes one image after the other and plays without end. Use it in a `with` statement."""

    def __init__(self, path: Path, fps: float, max_width_px: int = MAX_WIDTH_PX) -> None:
        """Open a file, whose end names its kind, the frame rate of the images, 1/s, and the largest width."""
        self._path, self._fps, self._max_width_px = path, fps, max_width_px
        self._step = int(np.ceil(2 * _TICK_MS * fps / 1000))
        self._n_images, self._pictures = 0, list[NDArray[np.uint8]]()

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        """Write the file; after an error, none."""
        if kind is None and self._pictures:
            ends_ms = 1000 * np.minimum(self._step * np.arange(1, len(self._pictures) + 1), self._n_images) / self._fps
            delays_ms = _TICK_MS * np.diff(np.rint(ends_ms / _TICK_MS).astype(int), prepend=0)
            duration = delays_ms.tolist() if len(delays_ms) > 1 else int(delays_ms[0])
            iio.imwrite(self._path, self._pictures, plugin="pillow", duration=duration, loop=0)

    def write(self, image: NDArray[np.uint8]) -> None:
        """Append an image, (H, W, 3) RGB, reduced; of a high rate one of several is taken.

        Raises:
            TrackerError: there are too many pictures.
        """
        if self._n_images % self._step == 0:
            if sum(picture.nbytes for picture in self._pictures) > DEFAULT_CACHE_BYTES:
                n = len(self._pictures)
                raise TrackerError(f"expected fewer than {n} pictures in an animation, found more; choose fewer frames")
            share = min(1.0, self._max_width_px / image.shape[1])
            size = (round(share * image.shape[1]), round(share * image.shape[0]))
            reduced = cv2.resize(image, size, interpolation=cv2.INTER_AREA) if share < 1 else image.copy()
            self._pictures.append(np.asarray(reduced, dtype=np.uint8))
        self._n_images += 1
