"""The descriptor of the voxel tracker."""

from dataclasses import replace

from tracker.estimation.by_frame.options import WHOLE_RUN
from tracker.estimation.tracking.method import Method, Option, PaperMode, later
from tracker.estimation.voxel.constants import MAX_VOXEL_M, MIN_VOXEL_M, PAPER_BODY


def _millimetres(length_m: float) -> float:
    return round(1000 * length_m, 6)


VOXEL_SIZE = Option(
    "voxel_size", "Voxels, mm", "edge of a voxel, mm", "30 by default, 50 in the paper's mode", "number",
    lambda s: _millimetres(s.voxel_m), lambda s, mm: replace(s, voxel_m=mm / _millimetres(1)),
    limits=(_millimetres(MIN_VOXEL_M), _millimetres(MAX_VOXEL_M)), step=_millimetres(MIN_VOXEL_M) / 2,
)  # fmt: skip
"""Shown in millimetres, stored in metres."""
SIZES = Option(
    "sizes", "Part sizes", "when part sizes are estimated: never, on the first frame, or on all frames",
    "first by default, always in the paper's mode", "choice", lambda s: s.sizes,
    lambda s, value: replace(s, sizes=value),
    {"frozen": "Those of the body", "first": "On the first frame", "always": "On all frames"},
)  # fmt: skip
VOXEL = Method(
    "voxel", "Voxels", "a Kalman filter on the parts of the body, measured by the voxels of the silhouettes",
    later(__package__, "settings", "VoxelSettings"), later(__package__, "tracker", "VoxelTracker"),
    (VOXEL_SIZE, SIZES, WHOLE_RUN),
    PaperMode("Mikic and others 2001", later(__package__, "paper", "paper_settings"), PAPER_BODY,
    later(__package__, "paper", "require_paper_body")),
)  # fmt: skip
