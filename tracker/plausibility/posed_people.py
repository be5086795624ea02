"""Compare points of a person in space with known joints of that person, such as those of tracked poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np

from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array
from tracker.observations.shifts import median_over_time
from tracker.observations.triangulation import INLIER_M
from tracker.plausibility.body_likelihood import Places, bones
from tracker.plausibility.readings import ReadPoints


@dataclass(frozen=True, eq=False)
class PosedPerson:
    """Joints of a person on some frames."""

    places: Places
    """Positions by name, (F, 3) each, metres; NaN where unknown."""
    ignores_offsets: bool = False
    """Whether the median offset of each joint costs nothing: where the motion is compared, not the place."""
    n_views: int = 3
    """Number of coordinates of a joint, each of which is measured."""
    knows_frames: bool = True
    """Whether they differ from frame to frame."""

    @property
    def certain(self) -> "PosedPerson":
        """All of it."""
        return self

    def costs(self, places: Places, shift: int = 0) -> Array:
        """Return how far joints lie from the known ones, (F,); see `readings.KnownPeople`."""
        names = [name for name in places if name in self.places]
        if not names:
            return np.full(len(next(iter(places.values()))), np.nan)
        given, known = (np.stack([p[n] for n in names], axis=1) for p in (places, self.places))
        shown = np.arange(len(given)) + shift
        inside = (shown >= 0) & (shown < len(known))
        steps = given - known[np.where(inside, shown, 0)]
        if self.ignores_offsets:
            steps[~inside] = np.nan
            steps -= median_over_time(steps)
        away_m = np.linalg.norm(steps, axis=-1)
        squares = np.minimum(away_m / INLIER_M, 1.0) ** 2
        n_known = np.isfinite(squares).sum(axis=1)
        return np.where(inside & (n_known > 0), np.nansum(squares, axis=1) / np.maximum(n_known, 1), np.nan)


def read_beside(
    known: Places, points: Array, frames: Sequence[int], up: Array, fps: float, ignores_offsets: bool = False
) -> ReadPoints:
    """Return points of a person beside known joints of that person, at equal steps from the first frame to the last.

    Args:
        known: joints on some frames; their names are those of the points.
        points: in the axes of their file, (F, n, 3), metres; NaN where unknown.
        frames: which frames these are, ascending, (F,).
        up: direction of the vertical, (3,).
        fps: frames of the session per second.
        ignores_offsets: see `PosedPerson`.
    """
    step = gcd(*np.diff(frames).tolist()) or 1
    rows = (np.asarray(frames) - frames[0]) // step
    both = np.full((2, rows[-1] + 1, len(known), 3), np.nan)
    both[:, rows] = points, np.stack([*known.values()], axis=1)
    names, stature = tuple(known), bones(known).stature
    stature = stature if np.isfinite(stature) else DEFAULT_HEIGHT_M
    person = PosedPerson(dict(zip(names, np.moveaxis(both[1], 1, 0), strict=True)), ignores_offsets)
    at = frames[0] + step * np.arange(len(both[0]))
    return ReadPoints(names, both[0][:, None], at, (stature,), up, fps, person)
