"""The poses of a frame before and after the last fit or search."""

from dataclasses import dataclass
from typing import Literal

from app.state.people import ShownPose
from tracker.geometry.arrays import Array

ComparedWork = Literal["fit", "search"]


@dataclass(frozen=True, eq=False)
class PoseComparison:
    """What a fit or a search changed on a frame. It holds as long as its result is shown unchanged."""

    number: int
    """Identifies it while the program runs; a search that continues keeps it."""
    frame: int
    work: ComparedWork
    before: tuple[ShownPose, ...]
    """Each person before."""
    after: tuple[Array, ...]
    """Pose of each person after, (n_values,)."""
    revisions: tuple[int, ...]
    """Model revision of each of these bodies."""
    before_px: float | None
    """Mean cost before, px; None while the frame has no evidence."""
    before_view_costs_px: tuple[float | None, ...]
    """Cost of each view before, px; empty while the frame has no evidence."""
    after_px: float | None
    after_view_costs_px: tuple[float | None, ...]
    warning: str = ""
    """Where edges and the user's placement disagree by much: a sentence for the user, or empty."""
    is_before_shown: bool = False
    """Whether the views show the poses before."""
