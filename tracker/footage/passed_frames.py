"""Frames that a decoder passed on its way to another, kept for steps backward."""

from collections import OrderedDict

from av.video.frame import VideoFrame

MAX_BYTES = 128 * 2**20
"""Bound for all cameras of a recording together, bytes: 72 frames each of four cameras of 640x480, 10 of 1920x1080.

A group of n frames of which w fit is read backward by decoding (n / w + 1) / 2 frames for each frame: one if the group
fits, two for w = n / 3. No other choice of w frames costs less, because every pass begins at the key frame.
"""


class PassedFrames:
    """The frames passed last, as decoded (half the size of RGB), by presentation time stamp. Bounded in bytes."""

    def __init__(self, max_bytes: int) -> None:
        """Begin empty; a frame that is larger than `max_bytes` is not kept."""
        self._frames: OrderedDict[int, tuple[VideoFrame, int]] = OrderedDict()
        self._max_bytes, self.n_bytes = max_bytes, 0

    def keep(self, pts: int, frame: VideoFrame) -> None:
        """Keep a frame, and discard those passed first until the rest fits."""
        self._discard(pts)
        n_bytes = sum(plane.buffer_size for plane in frame.planes)
        self._frames[pts] = frame, n_bytes
        self.n_bytes += n_bytes
        while self.n_bytes > self._max_bytes:
            self._discard(next(iter(self._frames)))

    def get(self, pts: int) -> VideoFrame | None:
        """Return the frame with a time stamp if it is kept."""
        return self._frames.get(pts, (None, 0))[0]

    def clear(self) -> None:
        """Discard all frames."""
        self._frames.clear()
        self.n_bytes = 0

    def _discard(self, pts: int) -> None:
        _, n_bytes = self._frames.pop(pts, (None, 0))
        self.n_bytes -= n_bytes
