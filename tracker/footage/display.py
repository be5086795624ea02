"""Turn decoded frames as their display matrix says: quarter turns and mirror images."""

from typing import NamedTuple

import numpy as np
from av.sidedata.sidedata import Type
from av.video.frame import VideoFrame

from tracker.geometry.arrays import Image


class DisplayTurn(NamedTuple):
    """A turn of the picture by quarters, with or without mirroring: first transpose, then mirror."""

    transposes: bool
    """Whether rows become columns."""
    mirrors_x: bool
    """Whether left and right are exchanged afterwards."""
    mirrors_y: bool
    """Whether top and bottom are exchanged afterwards."""

    @property
    def is_mirror(self) -> bool:
        """Whether no rotation gives the same picture."""
        return self.transposes ^ self.mirrors_x ^ self.mirrors_y

    def apply(self, image: Image) -> Image:
        """Turn a picture, (H, W, 3)."""
        turned = image.swapaxes(0, 1) if self.transposes else image
        turned = turned[:, ::-1] if self.mirrors_x else turned
        return np.ascontiguousarray(turned[::-1] if self.mirrors_y else turned)


def display_turn(frame: VideoFrame) -> DisplayTurn:
    """Return the turn that a frame's display matrix is nearest to; none without a matrix.

    FFmpeg's matrix maps a pixel (x, y) to (a x + c y, b x + d y), with y downwards (libavutil/display.h).
    """
    data = frame.side_data.get(Type.DISPLAYMATRIX)
    if data is None:
        return DisplayTurn(False, False, False)
    a, b, _, c, d = np.frombuffer(bytes(data), np.int32)[:5].tolist()
    if abs(b) + abs(c) > abs(a) + abs(d):
        return DisplayTurn(True, c < 0, b < 0)
    return DisplayTurn(False, a < 0, d < 0)


def displayed_size(frame: VideoFrame) -> tuple[int, int]:
    """Return width and height of a frame as displayed, px."""
    return (frame.height, frame.width) if display_turn(frame).transposes else (frame.width, frame.height)
