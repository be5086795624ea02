"""Predict a pose by a polynomial through the last poses (GD96 Sect. 4.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.motion.shortest_step import shortest_step
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array

MAX_ORDER = 2
"""Highest degree of a motion model: GD96 Sect. 4.2 predicts with constant acceleration."""


@dataclass(frozen=True)
class PredictSettings:
    """Settings of the motion model."""

    order: int = 1
    """Degree of the polynomial: 0 stays, 1 is constant velocity, 2 is constant acceleration, as in the paper. On noisy
    poses a parabola overshoots and tracks worse than constant velocity."""
    window: int = 3
    """Number of past poses it is fitted to."""
    full_window: bool = False
    """Whether the pose stays until there are as many past poses; else fewer are fitted, with a lower degree."""
    bound_rad: float = float(np.radians(25))
    """Largest predicted change of an angle from one frame to the next, rad."""
    bound_m: float = 0.10
    """Largest predicted change of a position from one frame to the next, metres."""

    def __post_init__(self) -> None:
        """Check the settings; raise a TrackerError for values that predict nothing."""
        if not 0 <= self.order <= MAX_ORDER or self.window < 1:
            raise TrackerError(
                f"expected a prediction of order 0 to {MAX_ORDER} over at least 1 past pose, found order "
                f"{self.order} over {self.window}"
            )


def predict(model: BodyModel, past: Sequence[Array], settings: PredictSettings) -> Array:
    """Extrapolate the past poses by one frame.

    The polynomial is fitted to the shortest steps from the last pose, so that a rotation continues through half a
    turn. With too few poses for the order, the order is reduced.

    Args:
        model: the body.
        past: its poses, one frame apart, the last one last, (n_values,) each; at least one.
        settings: degree, window and bounds.

    Returns:
        The predicted pose within the joint limits, (n_values,).
    """
    last, recent = past[-1], past[-settings.window :]
    short = settings.full_window and len(recent) < settings.window
    order = 0 if short else min(settings.order, len(recent) - 1)
    if order == 0:
        return model.clip(last)
    steps = np.array([shortest_step(model, p, last) for p in recent])
    times = np.arange(1.0 - len(recent), 1.0)
    coefficients = np.linalg.lstsq(np.vander(times, order + 1), steps, rcond=None)[0]
    step = coefficients.sum(axis=0)  # the polynomial at time 1
    bound = np.where(model.dof_is_length, settings.bound_m, settings.bound_rad)
    return model.clip(model.retract(last, np.clip(step, -bound, bound)))
