"""Draw trails: the paths of body points around the shown frame, from stored poses."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.drawing.overlay_colors import TRAIL_AFTER, TRAIL_BEFORE, TRAIL_END, rgb
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array

_MAX_GAP = 5
"""Poses more frames apart are not connected: the motion between them is unknown."""
_MAX_CACHED = 4000
"""Number of frames whose points are cached."""
_GAMMA = 2.2
"""Exponent from screen colours to light intensities."""

Poses = Callable[[range], Mapping[int, Array]]
"""Returns the stored poses of a person in a range, by frame."""


class TrailSegments(NamedTuple):
    """Line segments in space."""

    points_world: NDArray[np.float32]
    """End points, (N, 2, 3), metres."""
    colors: NDArray[np.uint8]
    """RGB at the end points, (N, 2, 3)."""


class Trails:
    """The trails of one person. Caches the points of frames until their poses change."""

    def __init__(self, model: BodyModel, poses: Poses) -> None:
        """Draw trails of a body with the stored poses that `poses` returns."""
        self._model, self._poses = model, poses
        self._points: dict[int, Array | None] = {}

    def forget(self, frames: Iterable[int]) -> None:
        """Drop cached frames whose poses changed."""
        for frame in frames:
            self._points.pop(frame, None)

    def segments(self, frame: int, length: int, names: frozenset[str], n_frames: int) -> TrailSegments:
        """Return the trails around a frame.

        Args:
            frame: the shown one.
            length: of the trail, frames to either side.
            names: of the points; those that the body does not have are ignored.
            n_frames: of the recording.
        """
        chosen = [i for i, name in enumerate(self._model.point_names) if name in names]
        window = range(max(0, frame - length), min(n_frames, frame + length + 1))
        found = self._at(window) if chosen else {}
        frames = np.array(sorted(found), dtype=np.int64)
        if len(frames) < 2:
            return TrailSegments(np.zeros((0, 2, 3), np.float32), np.zeros((0, 2, 3), np.uint8))
        points = np.stack([found[k] for k in frames])[:, chosen]  # (frames, points, 3)
        colors = np.broadcast_to(_colors(frames - frame, length)[:, None], points.shape)
        joined = np.diff(frames) <= _MAX_GAP
        pairs = np.stack([points[:-1], points[1:]], axis=2)[joined]  # (joined, points, 2, 3)
        tints = np.stack([colors[:-1], colors[1:]], axis=2)[joined]
        return TrailSegments(pairs.reshape(-1, 2, 3).astype(np.float32), tints.reshape(-1, 2, 3).astype(np.uint8))

    def _at(self, window: range) -> dict[int, Array]:
        missing = [k for k in window if k not in self._points]
        if missing:
            if len(self._points) + len(missing) > _MAX_CACHED:
                self._points = {k: p for k, p in self._points.items() if k in window}
            poses = self._poses(range(missing[0], missing[-1] + 1))
            self._points |= {k: self._model.points_world(poses[k]) if k in poses else None for k in missing}
        return {k: p for k in window if (p := self._points[k]) is not None}


def _colors(offsets: NDArray[np.int64], length: int) -> Array:
    """Return the colours of a trail, (N, 3): violet before the shown frame, green after it, grey at its ends.

    Args:
        offsets: frames from the shown one, (N,).
        length: of the trail, frames to either side.
    """
    near = np.clip(1 - np.abs(offsets) / (length + 1), 0.0, 1.0)[:, None]
    before, after, end = (np.array(rgb(c)) for c in (TRAIL_BEFORE, TRAIL_AFTER, TRAIL_END))
    shown = near * np.where(offsets[:, None] < 0, before, after) + (1 - near) * end
    # viser takes the colours of lines for light intensities, and would show these much paler.
    return np.asarray(255 * (shown / 255) ** _GAMMA)
