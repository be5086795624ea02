"""One way in which programs write calibrated cameras."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tracker.formats.anipose import Units
from tracker.formats.calibrations.camera_words import Section
from tracker.formats.calibrations.document import Document

OPENCV_POSES = "X_camera = R X_world + t"
"""Convention of poses that map world to camera."""


@dataclass(frozen=True)
class CalibrationLayout:
    """One way in which programs write calibrated cameras."""

    name: str
    """Name for people."""
    recognized_by: str
    """Content by which it is recognized."""
    poses: str
    """Convention of its poses, which is turned to `X_camera = R X_world + t`."""
    unit: Units | None
    """Unit of its translations; None if it does not fix one."""
    recognizes: Callable[[Document], bool]
    read: Callable[[Document], dict[str, Section]]
    """Reads the cameras of one file by their names. The name of a lone camera without one is empty: its file's."""
    by_program: bool = True
    """Whether programs alone write it, so that its convention is beyond doubt where it fits."""
    is_unit_sure: bool = True
    """Whether `unit` is that of all files: one that programs leave to their users may be another."""
    note: str = ""
    """Sentence for users on what its files leave open; usually empty."""
    join: Callable[[Sequence[Document]], Sequence[Document]] = tuple
    """Joins the files of cameras whose lens and pose lie in two."""
    halves: tuple[str, str] | None = None
    """Beginnings of the names of two such files, by which the one is found beside the other."""

    @property
    def has_opencv_poses(self) -> bool:
        """Whether its poses map world to camera."""
        return self.poses == OPENCV_POSES

    @property
    def poses_in_words(self) -> str:
        """The convention of its poses, for messages."""
        if self.has_opencv_poses:
            return f"poses that map world to camera ({OPENCV_POSES})"
        return f"poses of {self.name} ({self.poses})"
