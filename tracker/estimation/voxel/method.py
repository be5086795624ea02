"""The descriptor of the voxel tracker."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from tracker.estimation.by_frame.options import WHOLE_RUN
from tracker.estimation.tracking.method import Method, Option, PaperMode
from tracker.estimation.voxel.constants import MAX_VOXEL_M, MIN_VOXEL_M, PAPER_BODY

if TYPE_CHECKING:
    from tracker.body.model import BodyModel
    from tracker.estimation.voxel.settings import VoxelSettings
    from tracker.estimation.voxel.tracker import VoxelTracker


def _settings() -> "VoxelSettings":
    from tracker.estimation.voxel.settings import VoxelSettings

    return VoxelSettings()


def _paper_settings() -> "VoxelSettings":
    from tracker.estimation.voxel.paper import paper_settings

    return paper_settings()


def _require_paper_body(bodies: "Mapping[str, BodyModel]") -> None:
    from tracker.estimation.voxel.paper import require_paper_body

    require_paper_body(bodies)


def _tracker(settings: "VoxelSettings") -> "VoxelTracker":
    from tracker.estimation.voxel.tracker import VoxelTracker

    return VoxelTracker(settings)


VOXEL_SIZE = Option(
    "voxel_size", "Voxels, mm", "edge of a voxel, mm", "30 by default, 50 in the paper's mode", "number",
    lambda s: round(1000 * s.voxel_m, 6), lambda s, mm: replace(s, voxel_m=mm / 1000),
    limits=(1000 * MIN_VOXEL_M, 1000 * MAX_VOXEL_M), step=5,
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
    _settings, _tracker, (VOXEL_SIZE, SIZES, WHOLE_RUN),
    PaperMode("Mikic and others 2001", _paper_settings, PAPER_BODY, _require_paper_body),
)  # fmt: skip
