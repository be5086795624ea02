"""One camera of a session: its calibration and the paths of its images."""

from dataclasses import dataclass
from pathlib import Path

from tracker.geometry.cameras import Camera


@dataclass(frozen=True, eq=False)
class CameraSource:
    """A camera with its footage, background and masks."""

    camera: Camera
    footage: Path
    """Video file, or folder of images; absolute."""
    background: Path | None = None
    """Image, video, or folder of images of the empty scene in original pixels; absolute."""
    masks: Path | None = None
    """Folder of %06d.png by video frame: 0 background, 255 anyone, 1..K person K; original pixels; absolute."""
    offset: int = 0
    """Frame k of the session is frame k + offset of the footage; not negative."""
    declared_fps: float | None = None
    """Frame rate that the video declares where it is not the session's, as for high-speed footage, 1/s."""
    footage_frames: int | None = None
    """Number of frames of the footage where frames at its end are left out because other cameras lack them."""
