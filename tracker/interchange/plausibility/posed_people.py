"""Compare points of a person in space with known joints of that person, such as those of tracked poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import gcd

import numpy as np

from tracker.compute.quantiles import known_median
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array
from tracker.geometry.robust_triangulation import INLIER_M
from tracker.interchange.plausibility.body_likelihood import Places, bones
from tracker.interchange.plausibility.readings import ReadPoints


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

    def costs(self, places: Places) -> Array:
        """Return how far joints lie from the known ones, (F,); see `readings.KnownPeople`."""
        squares = np.minimum(self._away_m(places, 0) / INLIER_M, 1.0) ** 2
        n_known = np.isfinite(squares).sum(axis=1)
        return np.where(n_known > 0, np.nansum(squares, axis=1) / np.maximum(n_known, 1), np.nan)

    def lag_errors_m(self, places: Places, most: int) -> list[Array]:
        """Return how far joints lie from those of other frames, (2 most + 1, F, n_joints), metres, as a list of one."""
        return [np.stack([self._away_m(places, shift) for shift in range(-most, most + 1)])]

    def _away_m(self, places: Places, shift: int) -> Array:
        """Return the distances from the joints so many frames later, (F, n_joints); NaN where unknown."""
        names = [name for name in places if name in self.places]
        given, known = (np.array([p[n] for n in names]).reshape(len(names), -1, 3) for p in (places, self.places))
        steps = np.full(given.shape, np.nan)
        at = np.arange(given.shape[1])
        inside = (at + shift >= 0) & (at + shift < known.shape[1])
        steps[:, inside] = given[:, inside] - known[:, at[inside] + shift]
        steps = np.swapaxes(steps, 0, 1)
        return np.linalg.norm(steps - known_median(steps) * self.ignores_offsets, axis=-1)


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
