"""Choices of a user for the next tracking run, besides the settings of the tracker."""

from dataclasses import dataclass

from tracker.pipeline.methods import MethodName

MAX_STRIDE = 100
"""Largest stride."""


@dataclass(frozen=True)
class RunChoices:
    """The method, the frames and the cameras of a run."""

    method: MethodName = "chamfer"
    """The tracking method."""
    stride: int = 1
    """Every so many frames are tracked, from 1; the frames between get no pose."""
    cameras: tuple[str, ...] = ()
    """Names of the cameras to track with, in the order of the session; all if empty."""
