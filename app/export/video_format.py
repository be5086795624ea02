"""The overlay videos among the formats of `quadrille export`, by entry points of `pyproject.toml`."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.interchange.exports.formats import ExportFormat

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import ExportedMotion, ExportOptions


def _write(motion: "ExportedMotion", options: "ExportOptions", paths: Sequence[Path], tick: Callable[[], None]) -> None:
    from app.export.overlay_video import write_overlay_video

    write_overlay_video(motion, options, paths[0], tick)


def _overlay(name: str, title: str) -> ExportFormat:
    options = frozenset(("view", "character", "faces"))
    return ExportFormat(name, title, (f".{name}",), _write, options, gaps="shown without a body")


MP4, GIF, WEBP = (
    _overlay("mp4", "overlay video (MP4)"),
    _overlay("gif", "overlay animation (GIF)"),
    _overlay("webp", "overlay animation (WebP)"),
)
"""Overlay videos, drawn as in the page."""
