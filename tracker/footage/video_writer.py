"""Write footage as H.264 in short closed groups of pictures, which scrub well.

Write pictures as an animation that plays in documents and messages: GIF or animated WebP.
"""

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import cv2
import imageio.v3 as iio
import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.footage.recording import DEFAULT_CACHE_BYTES

GROUP_OF_PICTURES = 12
"""Distance of key frames, frames: as many are decoded at most to show one."""
RATE_FACTOR = 19
"""x264's constant rate factor: some 10 KB for a noisy frame of 640x480."""


class VideoWriter:
    """An MP4 file that takes one image after the other. Use it in a `with` statement."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, comment: str = "") -> None:
        """Open a video of a width and height in pixels, both even, a frame rate, 1/s, and a comment in its metadata."""
        # The same bytes on every run: no encoder threads, no date, no version of the muxer.
        self._file = av.open(str(path), "w", options={"fflags": "+bitexact"})
        if comment:
            self._file.metadata["comment"] = comment
        self._stream = self._file.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = {
            "crf": str(RATE_FACTOR),
            "g": str(GROUP_OF_PICTURES),
            "bf": "0",
            "flags": "+cgop",
            "threads": "1",
        }

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        """Finish the file."""
        if kind is None:
            self._file.mux(self._stream.encode(None))
        self._file.close()

    def write(self, image: NDArray[np.uint8]) -> None:
        """Append an image, (H, W, 3) RGB."""
        self._file.mux(self._stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))


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
