"""Bodies over the pictures as short lists of whole numbers."""

import json
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from app.export.overlay_video import drawn_paths
from tracker.evidence.images.working_view import WorkingView
from tracker.geometry.arrays import Array, FloatArray
from tracker.interchange.exports.motion import ExportedMotion

UNITS_PER_PX = 4
"""Positions are whole numbers of a quarter of a pixel of the picture, the accuracy of an antialiased line."""
_JOINED_PX = 0.01
"""Pieces of a contour whose ends are closer are joined, px of the footage."""


def view_lines(motion: ExportedMotion, frame: int, views: Sequence[WorkingView]) -> list[list[dict[str, Any]]]:
    """Return what is drawn over the pictures of a frame, for each view and each person with a pose.

    Returns:
        Index of the `person` in the session; `visible` and `hidden` contours as polylines u0, v0, du, dv, du, dv, ...;
        `points` of the skeleton, u, v or null twice each. All are in `UNITS_PER_PX`.
    """
    people = motion.bodies(frame)
    found = drawn_paths(motion, frame, range(len(views)))
    out = []
    for index, view in enumerate(views):
        ahead = motion.session.cameras[index].clock.offset_frames(frame)
        lines = []
        for k, (person, body) in enumerate(people):
            if not motion.is_exported(person, frame):
                continue
            own: dict[str, Any] = {"person": person.index, "visible": [], "hidden": []}
            for path in found:
                if (path.camera, path.person) == (index, k):
                    is_visible = path.kind == "model"
                    lines_of = polylines(path.segments_px, view.scale, 0.5 if is_visible else 1.0)
                    own["visible" if is_visible else "hidden"] += lines_of
            own["points"] = _points(view.camera.project(body.ahead(ahead).points_world))
            lines.append(own)
        out.append(lines)
    return out


def compact(data: Any) -> str:
    """Return data as JSON in as few characters as possible."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


def polylines(segments_px: FloatArray, scale: float, tolerance_px: float) -> list[list[int]]:
    """Join segments that follow one another, simplify the lines (Douglas-Peucker), and round them.

    Args:
        segments_px: x0, y0, x1, y1, (N, 4), px.
        scale: pixels of the picture per pixel of the segments.
        tolerance_px: distance by which a line may move, px of the picture.

    Returns:
        Polylines as `view_lines` has them.
    """
    if not len(segments_px):
        return []
    gaps = np.abs(segments_px[1:, :2] - segments_px[:-1, 2:]).max(axis=1) > _JOINED_PX
    out = []
    for run in np.split(segments_px, np.flatnonzero(gaps) + 1):
        line = np.vstack([run[:, :2], run[-1:, 2:]]) * scale + 0.5 * (scale - 1)  # pixel centres lie at integers
        kept = cv2.approxPolyDP(line.astype(np.float32), tolerance_px, False).reshape(-1, 2)
        out.append(np.diff(np.round(kept * UNITS_PER_PX).astype(int), axis=0, prepend=0).ravel().tolist())
    return out


def _points(px: Array) -> list[int | None]:
    """Return positions, (n, 2), one after the other; None for a point that the picture cannot show."""
    return [None if not np.isfinite(x) or abs(x) > 1e5 else round(UNITS_PER_PX * x) for x in px.ravel().tolist()]
