"""The observed points of one person that are points of the body, over all frames and views."""

from dataclasses import dataclass

import numpy as np

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Observed points of one person."""

    names: tuple[str, ...]
    """Names of the body's points, (N,)."""
    joints_world: Array
    """Their positions in the world, (F, N, 3), metres; NaN where unknown."""
    seen: Array
    """Their positions in each view, (F, V, N, 2), in normalized image coordinates x / z; NaN where absent."""
    confidence: Array
    """(F, V, N), 0 to 1; 0 where absent."""

    def known_to(self, model: BodyModel) -> "BodyPoints":
        """Return those that are points of a body."""
        at = [i for i, n in enumerate(self.names) if n in model.point_names]
        names = tuple(self.names[i] for i in at)
        return BodyPoints(names, self.joints_world[:, at], self.seen[:, :, at], self.confidence[:, :, at])

    def places(self, frame: int) -> dict[str, Array]:
        """Return the points that are known on a frame by name, (3,) each, metres."""
        known = np.isfinite(self.joints_world[frame]).all(axis=1)
        return {n: p for n, p, k in zip(self.names, self.joints_world[frame], known, strict=True) if k}
