"""An exporter of another package: one line for each person and frame, in the command line and in the page's menu."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from quadrille import ExportFormat

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import ExportedMotion, ExportOptions


def write(motion: "ExportedMotion", options: "ExportOptions", paths: Sequence[Path], tick: Callable[[], None]) -> None:
    """Write the position of the root of each exported person."""
    lines = []
    for frame in motion.frames:
        for person in motion.exported:
            if frame in person.poses:
                x, y, z = person.body(frame).joint_centers_world[0]
                lines.append(f"{frame} {person.person.name} {x:.3f} {y:.3f} {z:.3f}\n")
        tick()
    paths[0].write_text("".join(lines), "utf-8")


ROOTS = ExportFormat("roots", "positions of the roots (text)", (".txt",), write, gaps="left out")
