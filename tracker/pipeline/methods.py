"""The tracking methods by name."""

from collections.abc import Callable, Mapping
from typing import Any, Literal, TypeAlias

from tracker.errors import TrackerError
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.contour.tracker import ContourTracker
from tracker.tracking.tracker import Tracker, TrackerSettings
from tracker.tracking.voxel.tracker import VoxelTracker

MethodName: TypeAlias = Literal["chamfer", "contour", "voxel"]
METHODS: Mapping[str, Callable[[Any], Tracker]] = {
    "chamfer": ChamferTracker,
    "contour": ContourTracker,
    "voxel": VoxelTracker,
}
"""Makes the tracker of each method from its settings."""


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
