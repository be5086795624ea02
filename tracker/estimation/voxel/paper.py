"""The tracker as MTHC01 describe it: its settings, and the body that it is for.

The paper leaves some choices open; docs/log/trackers.md lists them.
"""

from functools import partial

from tracker.estimation.tracking.tracker import require_body
from tracker.estimation.voxel.constants import PAPER_BODY
from tracker.estimation.voxel.measurement import MeasurementNoise
from tracker.estimation.voxel.motion_model import ProcessNoise
from tracker.estimation.voxel.settings import VoxelSettings

PAPER_VOXEL_M = 0.05
"""Edge of the paper's voxels, metres (MTHC01 Sect. 1)."""


def paper_settings(voxel_m: float = PAPER_VOXEL_M) -> VoxelSettings:
    """Return the settings of MTHC01: sizes in the state, the torso's velocity alone, each voxel labelled once.

    Args:
        voxel_m: edge of a voxel, metres.
    """
    return VoxelSettings(
        voxel_m=voxel_m,
        sizes="always",
        turn_rates=False,
        process=ProcessNoise(turn=1.0, turn_rate=0.0, size=0.01, center=0.02, velocity=2.0, damping=0.0),
        measurement=MeasurementNoise(across_m=0.03, along=0.0, turn=0.15, size_m=0.03, independent_m3=None),
        iterations=1,
        start_iterations=1,
        gate=None,
        widened=False,
        by_size=True,
        levels=False,
        limit_rad=None,
        whole_run=False,
        paper=True,
    )


require_paper_body = partial(require_body, PAPER_BODY, object)
"""Raises a TrackerError where people, by name, have another body than that of MTHC01, of any sizes."""
