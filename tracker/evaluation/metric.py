"""A measure of error that another package adds to evaluations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from tracker.compute.extensions import usable

if TYPE_CHECKING:
    from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class ComparedJoints:
    """Joints of an estimate and of its reference, F frames and m joints."""

    names: tuple[str, ...]
    """Of the joints, (m,)."""
    frames: tuple[int, ...]
    """Of the session, (F,)."""
    fps: float
    """Frame rate of the session, 1/s."""
    estimate: "Array"
    """Positions, (F, m, 3), metres, after the alignment; NaN where missing."""
    truth: "Array"
    """Positions of the reference, likewise."""


@dataclass(frozen=True)
class Metric:
    """A measure of error. The name of its entry point is its own."""

    name: str
    """By which the result has it."""
    title: str
    """Its content, for people."""
    unit: str
    """Such as mm; empty for a share."""
    compute: Callable[[ComparedJoints], float]
    """Computes it; NaN where it is not defined."""


@cache
def metrics() -> Mapping[str, Metric]:
    """Return the metrics of other packages by name; see `tracker.compute.extensions`."""
    return usable("quadrille.metrics", Metric)
