"""Write footage as H.264 in short closed groups of pictures, which scrub well."""

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray

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
