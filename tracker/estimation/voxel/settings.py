"""Settings of the voxel tracker."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.voxel.constants import MAX_VOXEL_M, MIN_VOXEL_M
from tracker.estimation.voxel.labels import LabelRule
from tracker.estimation.voxel.measurement import MeasurementNoise
from tracker.estimation.voxel.motion_model import ProcessNoise

SizeEstimation = Literal["frozen", "first", "always"]
"""When part sizes are estimated: never, on the first frame of a run, or on all frames."""


def check_voxel_size(voxel_m: float) -> None:
    """Raise a `TrackerError` for an edge of a voxel, metres, that shows no limbs, or too much."""
    if not MIN_VOXEL_M <= voxel_m <= MAX_VOXEL_M:
        raise TrackerError(
            f"expected voxels of {1000 * MIN_VOXEL_M:g} to {1000 * MAX_VOXEL_M:g} mm, found {1000 * voxel_m:g} mm; "
            "25 to 50 mm are usual"
        )


@dataclass(frozen=True)
class VoxelSettings:
    """Settings of the voxel tracker."""

    method: ClassVar[str] = "voxel"
    """Name of the method, which the store keeps with the settings."""
    voxel_m: float = 0.03
    """Edge of a voxel, metres."""
    sizes: SizeEstimation = "first"
    """When part sizes are estimated. Frozen sizes are those of the person's body."""
    turn_rates: bool = True
    """Whether the state has the angular velocities of all parts; the paper has the torso's velocity alone."""
    process: ProcessNoise = field(default_factory=lambda: ProcessNoise(0.1, 12.0, 0.0, 0.02, 4.0, 4.0))
    """How the state may change by itself."""
    measurement: MeasurementNoise = field(default_factory=lambda: MeasurementNoise(0.02, 0.3, 0.08, 0.02, 0.0003))
    """Noise of what voxels measure."""
    start_turn: float = 0.2
    """Standard deviation of the rotations of a start or a keyframe, rad: it moves the end of a limb by `start_m`."""
    start_m: float = 0.06
    """Standard deviation of the place of a start or a keyframe, metres: twice the mean error of found joints along an
    axis. With 0.08 m and 0.25 rad, the trunk of the man of `two_people` takes the voxels of an arm on the first frame,
    which is lost for 42 of 60 frames; here 14. With half as much, no person of five changes by more than 5 mm."""
    start_size_m: float = 0.02
    """Standard deviation of the half sizes of the start, metres."""
    iterations: int = 2
    """Number of times that voxels are labelled on a frame, each time by the state found last; once in the paper."""
    start_iterations: int = 6
    """The same on the first frame."""
    gate: float | None = 25.0
    """Squared Mahalanobis distance from which on a voxel belongs to no part; None: each has one, as in the paper."""
    widened: bool = True
    """Whether parts are widened by the uncertainty of their prediction when voxels are labelled."""
    by_size: bool = False
    """Whether measured axes are told apart by size, as in the paper, else by the prediction."""
    levels: bool = True
    """Whether parts that the voxels do not resolve are measured on a coarser level (MTHC01 Sect. 6)."""
    limit_rad: float | None = 0.15
    """Standard deviation of the parts' rotations from the closest pose of the body, whose joints have limits, rad.
    None: the figure's joints are balls without limits, as in the paper."""
    whole_run: bool = True
    """Whether the poses are smoothed at the end of a run."""
    paper: bool = False
    """Whether the run is that of the paper."""

    def __post_init__(self) -> None:
        """Check the settings; raise a TrackerError for a voxel size that shows no limbs, or too much."""
        check_voxel_size(self.voxel_m)

    @property
    def label_rule(self) -> LabelRule:
        """How voxels are assigned to parts."""
        return LabelRule(np.inf if self.gate is None else self.gate, self.widened)
