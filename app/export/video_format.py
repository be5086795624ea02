"""The overlay video among the formats of `quadrille export`, by an entry point of `pyproject.toml`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.interchange.exports.export_format import ExportFormat

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import ExportedMotion
    from tracker.interchange.exports.options import ExportOptions


def _write(motion: "ExportedMotion", options: "ExportOptions", paths: Sequence[Path], tick: Callable[[], None]) -> None:
    from app.export.overlay_video import write_overlay_video

    write_overlay_video(motion, options, paths[0], tick)


MP4 = ExportFormat(
    "mp4", "overlay video (MP4)", (".mp4",), _write, frozenset(("view", "character")), gaps="shown without a body"
)
"""Overlay video, drawn as in the page."""
