"""The tracker as MTHC01 describe it: its settings, and the body that it is for.

The paper leaves some choices open; docs/trackers.md lists them.
"""

from collections.abc import Mapping
from functools import cache

from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.estimation.voxel.constants import PAPER_BODY
from tracker.estimation.voxel.measurement import MeasurementNoise
from tracker.estimation.voxel.motion_model import ProcessNoise
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.model_toml import load_model

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


def require_paper_body(bodies: Mapping[str, BodyModel]) -> None:
    """Check that people have the body of MTHC01, of any sizes.

    Args:
        bodies: by name of the person.

    Raises:
        TrackerError: a person has another body.
    """
    for name, body in bodies.items():
        if body.dof_names != _paper_dofs():
            raise TrackerError(
                f"expected the paper's body {PAPER_BODY} of '{name}', found {body.name} of {body.n_dofs} degrees of "
                "freedom",
                Remedy("paper_body", body=PAPER_BODY),
            )


@cache
def _paper_dofs() -> tuple[str, ...]:
    """Return the names of the degrees of freedom of the paper's body."""
    return load_model(PAPER_BODY, 1.0).dof_names
