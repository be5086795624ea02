"""Write a motion to files that are arrays over frames, people and points, one function for each format."""

from collections.abc import Callable, Sequence
from pathlib import Path

from tracker.export.motion import ExportedMotion
from tracker.export.options import ExportOptions
from tracker.export.pose_arrays import pose_arrays
from tracker.formats.interchange.c3d import write_c3d


def write_person_c3d(
    motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Callable[[], None]
) -> None:
    """Write the points of one person as C3D; residuals are the errors that the audit expects."""
    found = pose_arrays(motion, options)
    write_c3d(
        paths[0], found.points, found.joints[:, 0], motion.session.fps,
        first_frame=motion.frames[0], residuals=found.errors_m[:, 0], units=options.units,
    )  # fmt: skip
    for _ in motion.frames:
        tick()
