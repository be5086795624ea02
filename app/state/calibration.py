"""The check of the cameras: its progress, what it found, and the preview of the corrections."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from app.state.progress import WorkState
from tracker.body.model import PosedBody
from tracker.geometry.cameras import Camera
from tracker.pipeline.calibration_check import CalibrationCheck
from tracker.pipeline.fast_moment import FastMoment
from tracker.session.synchronize import FoundStart


@dataclass(frozen=True, eq=False)
class CorrectedFrame:
    """A frame with the corrected cameras, and the people refitted to it."""

    frame: int
    cameras: tuple[Camera, ...]
    """Without lens distortion."""
    bodies: tuple[tuple[PosedBody, ...], ...]
    """By camera and person: each camera sees the people at its own time."""
    cost_before: float
    """Half the weighted sum of squares of the contours, nats, with the present cameras."""
    cost_after: float
    """The same with the corrected ones."""


@dataclass(frozen=True, eq=False)
class ClocksState(WorkState):
    """Estimates of the clocks of the cameras, and a moment to compare them by."""

    way: str = ""
    """Kind of data of the last estimate: `motion`, `sound`, `flash` or `time code`; empty before."""
    found: tuple[FoundStart, ...] = ()
    notes: tuple[str, ...] = ()
    """Sentences on clocks that disagree with the estimate."""
    views: tuple[int, ...] = ()
    """Indices of the cameras that `moment` is of."""
    moment: FastMoment | None = None


@dataclass(frozen=True, eq=False)
class CalibrationState(WorkState):
    """A check of the cameras, and the poses of an earlier calibration."""

    check: CalibrationCheck | None = None
    """Result of the last check; None before, and after its corrections were applied."""
    n_others: int = 0
    """Number of frames that the check did not use, on which its corrections were compared."""
    n_better: int = 0
    """Number of those that fit better with the corrections."""
    refused: str = ""
    """Why the corrections cannot be applied; empty if they can, or if there are none."""
    is_previewed: bool = False
    """Whether the views show the corrections."""
    preview: CorrectedFrame | None = None
    """The last frame that was refitted for the preview."""
    n_changes: int = 0
    """Number of times that the cameras of the open session were exchanged."""
    revision: int = 1
    """Number of the present calibration; 1 if it has never been changed."""
    outdated: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    """Frames with poses of an earlier calibration, ascending, by index of the person."""

    def shown_on(self, frame: int) -> CorrectedFrame | None:
        """Return the preview of a frame if the views show it; None otherwise."""
        found = self.preview if self.is_previewed else None
        return found if found is not None and found.frame == frame else None
