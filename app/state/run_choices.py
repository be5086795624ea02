"""Choices of a user for the next tracking run, besides the settings of the search."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from tracker.estimation.tracking.method import OptionValue
from tracker.pipeline.methods import METHODS

MAX_STRIDE = 100
"""Largest stride."""


@dataclass(frozen=True)
class RunChoices:
    """The method, the frames and the cameras of a run."""

    method: str = next(iter(METHODS))
    """Name of the tracking method."""
    stride: int = 1
    """Every so many frames are tracked, from 1; the frames between get no pose."""
    cameras: tuple[str, ...] = ()
    """Names of the cameras to track with, in the order of the session; all if empty."""
    options: Mapping[str, OptionValue] = field(default_factory=dict)
    """Options of methods that differ from the default, by name."""
