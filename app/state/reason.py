"""Why a pose is in doubt: what each view shows of each part, and poses that may be as likely."""

from dataclasses import dataclass

from app.state.progress import WorkState
from tracker.estimation.by_frame.part_evidence import Contradiction, PartTable
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class RankedPose:
    """Another pose of the person."""

    values: Array
    """Pose, (n_values,)."""
    nats: float
    """How much more it costs than the shown pose, nats; negative if it is better."""
    limbs: tuple[str, ...]
    """Limbs that are elsewhere, as text for the user."""


@dataclass(frozen=True, eq=False)
class Reason:
    """The table of one pose, and the poses beside it."""

    frame: int
    person: int
    values: Array
    """The pose that it is about, (n_values,)."""
    table: PartTable
    contradiction: Contradiction | None
    """The worst cell; None where no view clearly contradicts the pose."""
    alternatives: tuple[RankedPose, ...] | None = None
    """Poses by which a limb is doubtful, cheapest first; None before they are known."""


@dataclass(frozen=True)
class ReasonState(WorkState):
    """The reason for the shown pose. Its message says why there is no table."""

    found: Reason | None = None
    """The newest one; see `State.reason`."""
