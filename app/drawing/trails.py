"""The ways that points of the bodies take around the shown frame, from stored poses."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array

_MOST_GAP = 5
"""Poses more frames apart are not joined: nobody knows what lies between."""
_MOST_KEPT = 4000
"""Frames whose points are remembered."""
_BEFORE_RGB = np.array([38.0, 112.0, 233.0])
_AFTER_RGB = np.array([240.0, 120.0, 20.0])
_FAR_RGB = np.array([140.0, 140.0, 145.0])
"""Colours of a trail at the shown frame, from before and from after, and at its ends."""
_GAMMA = 2.2
"""From the colours of a screen to intensities of light."""

Poses = Callable[[range], Mapping[int, Array]]
"""Gives the stored poses of a person by frame, on those of a range that have one."""


class Segments(NamedTuple):
    """Line segments in space."""

    points_world: NDArray[np.float32]
    """End points, (N, 2, 3), metres."""
    colors: NDArray[np.uint8]
    """RGB at the end points, (N, 2, 3)."""


class Trails:
    """The trails of one person; remembers the points of frames whose poses have not changed."""

    def __init__(self, model: BodyModel, poses: Poses) -> None:
        """Draw trails of this body, whose stored poses `poses` gives."""
        self._model, self._poses = model, poses
        self._points: dict[int, Array | None] = {}

    def forget(self, frames: Iterable[int]) -> None:
        """Let go of frames whose poses have changed."""
        for frame in frames:
            self._points.pop(frame, None)

    def segments(self, frame: int, length: int, names: frozenset[str], n_frames: int) -> Segments:
        """The trails around a frame.

        Args:
            frame: the shown one.
            length: frames to either side.
            names: the points to follow; those that the body does not have are passed over.
            n_frames: of the recording.
        """
        chosen = [i for i, name in enumerate(self._model.point_names) if name in names]
        window = range(max(0, frame - length), min(n_frames, frame + length + 1))
        found = self._at(window) if chosen else {}
        frames = np.array(sorted(found), dtype=np.int64)
        if len(frames) < 2:
            return Segments(np.zeros((0, 2, 3), np.float32), np.zeros((0, 2, 3), np.uint8))
        points = np.stack([found[k] for k in frames])[:, chosen]  # (frames, points, 3)
        colors = np.broadcast_to(_colors(frames - frame, length)[:, None], points.shape)
        joined = np.diff(frames) <= _MOST_GAP
        pairs = np.stack([points[:-1], points[1:]], axis=2)[joined]  # (joined, points, 2, 3)
        tints = np.stack([colors[:-1], colors[1:]], axis=2)[joined]
        return Segments(pairs.reshape(-1, 2, 3).astype(np.float32), tints.reshape(-1, 2, 3).astype(np.uint8))

    def _at(self, window: range) -> dict[int, Array]:
        missing = [k for k in window if k not in self._points]
        if missing:
            if len(self._points) + len(missing) > _MOST_KEPT:
                self._points = {k: p for k, p in self._points.items() if k in window}
            poses = self._poses(range(missing[0], missing[-1] + 1))
            self._points |= {k: self._model.points_world(poses[k]) if k in poses else None for k in missing}
        return {k: p for k in window if (p := self._points[k]) is not None}


def _colors(offsets: NDArray[np.int64], length: int) -> Array:
    """Colours of moments of a trail, (N, 3): blue before the shown frame, orange after, grey far from it.

    Args:
        offsets: frames from the shown one, (N,).
        length: of the trail, frames to either side.
    """
    near = np.clip(1 - np.abs(offsets) / (length + 1), 0.0, 1.0)[:, None]
    shown = near * np.where(offsets[:, None] < 0, _BEFORE_RGB, _AFTER_RGB) + (1 - near) * _FAR_RGB
    # viser takes the colours of lines for intensities of light, and would show these much paler.
    return np.asarray(255 * (shown / 255) ** _GAMMA)
