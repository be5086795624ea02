"""The tracking methods by name."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, Literal, TypeAlias

from tracker.errors import TrackerError
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.contour.tracker import ContourTracker
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.tracker import Tracker, TrackerSettings

MethodName: TypeAlias = Literal["chamfer", "contour"]
METHODS: Mapping[str, Callable[[Any], Tracker]] = {"chamfer": ChamferTracker, "contour": ContourTracker}
"""Makes the tracker of each method from its settings."""

_SHARED = ("predict", "recover", "theta_px", "outliers", "backward_pass", "smooth")
"""Settings that a user chooses for every method."""


def of_method(settings: TrackSettings, method: MethodName) -> TrackSettings | ContourSettings:
    """Return the settings of a run by a method: the chosen ones, as far as it has them."""
    if method == "chamfer":
        return settings
    shared = {f.name: getattr(settings, f.name) for f in fields(EstimationSettings) if f.name in _SHARED}
    return ContourSettings(**shared)


def make_tracker(settings: TrackerSettings) -> Tracker:
    """Return the tracker of the method that the settings belong to.

    Raises:
        TrackerError: the method is unknown.
    """
    if settings.method not in METHODS:
        raise TrackerError(
            f"expected a tracking method among {', '.join(METHODS)}, found '{settings.method}'; choose one of them"
        )
    return METHODS[settings.method](settings)
