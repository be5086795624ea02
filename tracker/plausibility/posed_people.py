"""Compare points of a person in space with known joints of that person, such as those of tracked poses."""

from dataclasses import dataclass

import numpy as np

from tracker.geometry.arrays import Array
from tracker.observations.triangulation import INLIER_M
from tracker.plausibility.body_likelihood import Places


@dataclass(frozen=True, eq=False)
class PosedPerson:
    """Joints of a person on some frames."""

    places: Places
    """Positions by name, (F, 3) each, metres; NaN where unknown."""
    n_views: int = 3
    """Number of coordinates, each of which tells where a joint is."""
    knows_frames: bool = True
    """Whether they differ from frame to frame."""

    @property
    def certain(self) -> "PosedPerson":
        """All of it."""
        return self

    def costs(self, places: Places, shift: int = 0) -> Array:
        """Return how far joints lie from the known ones, (F,); see `readings.Witness`."""
        names = [name for name in places if name in self.places]
        if not names:
            return np.full(len(next(iter(places.values()))), np.nan)
        given, known = (np.stack([p[n] for n in names], axis=1) for p in (places, self.places))
        shown = np.arange(len(given)) + shift
        inside = (shown >= 0) & (shown < len(known))
        away_m = np.linalg.norm(given - known[np.where(inside, shown, 0)], axis=-1)
        squares = np.minimum(away_m / INLIER_M, 1.0) ** 2
        n_known = np.isfinite(squares).sum(axis=1)
        return np.where(inside & (n_known > 0), np.nansum(squares, axis=1) / np.maximum(n_known, 1), np.nan)
