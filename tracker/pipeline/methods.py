"""The tracking methods by name."""

from typing import TYPE_CHECKING

from tracker.errors import TrackerError
from tracker.estimation.chamfer.method import CHAMFER
from tracker.estimation.contour.method import CONTOUR
from tracker.estimation.tracking.method import Method, Option
from tracker.estimation.voxel.method import VOXEL

if TYPE_CHECKING:
    from tracker.estimation.by_frame.settings import EstimationSettings
    from tracker.estimation.tracking.tracker import Tracker, TrackerSettings

METHODS: dict[str, Method] = {method.name: method for method in (CHAMFER, CONTOUR, VOXEL)}
"""All methods in the order in which they are shown. The first is the default."""


def method_named(name: str) -> Method:
    """Return a method.

    Raises:
        TrackerError: it is unknown.
    """
    if name not in METHODS:
        raise TrackerError(f"expected a tracking method among {', '.join(METHODS)}, found '{name}'; choose one of them")
    return METHODS[name]


def make_tracker(settings: "TrackerSettings") -> "Tracker":
    """Return the tracker of the method that the settings belong to.

    Raises:
        TrackerError: the method is unknown.
    """
    return method_named(settings.method).make_tracker(settings)


def compared_by(settings: "TrackerSettings") -> "EstimationSettings":
    """Return the settings of the evidence by which the poses of a run are compared: its own, or those of contours where
    the method measures something else."""
    from tracker.estimation.by_frame.settings import EstimationSettings
    from tracker.estimation.chamfer.settings import TrackSettings

    return settings if isinstance(settings, EstimationSettings) else TrackSettings()


def all_options() -> dict[str, Option]:
    """Return the options of all methods by name."""
    return {option.name: option for method in METHODS.values() for option in method.options}
