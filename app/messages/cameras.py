"""Messages about the cameras of the session: the check of the calibration and the clocks, as `base` explains."""

from typing import Literal

from app.drawing.misfit_field import MisfitArrow
from app.messages.base import Command, Index, Part, WorkMessage

# --- from the page --------------------------------------------------------------------------------------------------


class CheckCalibration(Command, frozen=True, tag="calibration_check"):
    """Check the cameras by the tracked people, preview the corrections, apply them, or track again what is older."""

    action: Literal["start", "stop", "preview", "leave", "apply", "track_again"]


class UseClocks(Command, frozen=True, tag="clocks"):
    """Nudge the clock of a camera, estimate the clocks or stop that, take an estimate, or find a fast moment."""

    action: Literal["nudge", "estimate", "take", "moment", "stop"]
    camera: Index = 0
    """Index of the camera; not of an estimate, which is of all."""
    other: Index = 0
    """Index of the camera whose picture is shown beside it; of a moment."""
    frames: float = 0.0
    """Time by which the camera is to show later pictures, frames; of a nudge."""
    way: Literal["motion", "sound", "flash", "time code"] = "motion"
    """Data that the clocks are estimated by."""


# --- to the page ----------------------------------------------------------------------------------------------------


class CameraCheck(Part, frozen=True):
    """Judgement of a check on one camera. Numbers that are corrected are 0 where the camera is not off."""

    name: str
    misfit_px: float
    misfit_mm: float
    kinds: tuple[str, ...]
    """How it is off: `rotation`, `position`, `focal`, `time`, `drift`; empty where it is not."""
    rivals: dict[str, tuple[float, ...]]
    """The numbers of each kind that explains the contours as well, in the units of its field."""
    rotation_deg: tuple[float, ...]
    """About its right, down and forward axes."""
    position_mm: tuple[float, ...]
    """Along the same axes."""
    focal_percent: float
    time_ms: float
    drift_ms_per_s: float
    sigma: dict[str, tuple[float, ...]]
    """Standard deviations, by the name of the field; of one number, too."""
    since_frame: int | None
    """The frame from which on it is off; null for all frames."""
    lost_frames: int
    """Number of frames that it lost before that one; negative where it doubled some."""
    is_seen: bool
    """Whether it shows the people at all."""


class CalibrationMessage(WorkMessage, frozen=True, tag="calibration"):
    """The check of the cameras: its progress, or its result."""

    is_checked: bool
    """Whether there is a result."""
    frames: tuple[int, ...]
    """Frames that the check used."""
    cameras: tuple[CameraCheck, ...]
    sentences: tuple[str, ...]
    """Sentences for the user; empty where no camera is off."""
    misfits: tuple[MisfitArrow, ...]
    """Mean shifts from contours to edges in cells of the pictures, over the frames that the check used."""
    misfit_factor: int
    """Factor by which they are drawn longer, the same in all pictures."""
    others: int
    """Number of other frames on which the corrections were compared."""
    better: int
    """Number of those that fit better with them."""
    refused: str
    """Why the corrections cannot be applied, or empty."""
    is_previewed: bool
    """Whether the views show the corrections."""
    preview_frame: int | None
    """The frame that is previewed; null until it is ready."""
    preview_fall_nats: float
    """Fall of the cost of that frame by the corrections."""
    revision: int
    """Number of the present calibration, from 1 on; each correction makes another."""
    outdated: tuple[tuple[tuple[int, int], ...], ...]
    """Of each person, the first and last frames of intervals with poses of an earlier calibration."""


class FoundClock(Part, frozen=True):
    """An estimate of the clock of a camera."""

    offset_frames: float | None
    """As `CameraClock.offset_frames`; null where nothing was found."""
    drift_ms_per_s: float | None
    """Null where it is not estimated."""
    sigma_ms: float | None
    """Standard deviation of the offset; null where it is not known."""
    is_clear: bool
    """Whether it can be taken."""


class CameraClock(Part, frozen=True):
    """The clock of a camera against that of the session."""

    offset_frames: float
    """Frame of the footage, with its fraction, at the time of frame 0."""
    drift_ms_per_s: float
    """Change of the time of its pictures after each second."""
    found: FoundClock | None
    """Null for the camera that the others are compared with, and without an estimate."""


class ComparedMoment(Part, frozen=True):
    """A moment at which a point moves fast in two views."""

    frame: int
    views: tuple[int, ...]
    """Indices of the cameras."""
    centers: tuple[tuple[float, float], ...]
    """Place of the point in each, undistorted px."""
    source: str
    """Data that it was found by, for display."""


class ClocksMessage(WorkMessage, frozen=True, tag="clocks"):
    """The clocks of all cameras, in their order, and the work on them."""

    cameras: tuple[CameraClock, ...]
    way: str
    """Data of the last estimate; empty without one."""
    notes: tuple[str, ...]
    """Sentences on clocks that disagree with the estimate."""
    moment: ComparedMoment | None
