"""Poses that are compared: of a frame before and after a fit or search, and of a range with those they replaced."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from app.state.people import ShownPose
from tracker.estimation.initialization.silhouette_check import SilhouetteCheck
from tracker.estimation.posing.limb_moves import LimbMove
from tracker.geometry.arrays import Array

ComparedWork = Literal["fit", "search"]


@dataclass(frozen=True, eq=False)
class PoseComparison:
    """Changes of a fit or a search on a frame. They hold as long as its result is shown unchanged."""

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
    """Sentence for the user on a large disagreement of edges and placement; empty without one."""
    moved: tuple[tuple[int, LimbMove], ...] = ()
    """Limbs that a fit moved although nobody had touched them, each after the index of its person; farthest first."""
    filled: SilhouetteCheck = field(default_factory=lambda: SilhouetteCheck((), np.zeros(0)))
    """How far the bodies fill the silhouettes after a fit; no views where nothing shows them."""
    is_before_shown: bool = False
    """Whether the views show the poses before."""


@dataclass(frozen=True)
class ComparedPose:
    """The pose of a person in a frame, against the pose that it replaced."""

    frame: int
    method: str
    """Method of the tracker, or the source of the values."""
    other_method: str
    cost_px: float | None
    other_cost_px: float | None
    status: str
    """As its tracker assessed it; empty if none did."""
    other_status: str
    apart_mm: float
    """Mean distance between the joints of both poses."""
    farthest_mm: float
    """Largest of these distances."""
    farthest: str
    """Name of that joint, for display."""


Verdict = Literal["better", "worse", "same"]


@dataclass(frozen=True)
class Stretch:
    """Frames on which the present poses of a person are better or worse than those that they replaced."""

    person: int
    """Index of the person."""
    first: int
    last: int
    """Included."""
    frames: int
    """Number of frames that are better or worse; on the others neither is."""
    verdict: Verdict


@dataclass(frozen=True, eq=False)
class RangeComparison:
    """The poses of a range of frames against those that they replaced."""

    first: int
    last: int
    """Included."""
    frames: tuple[tuple[ComparedPose, ...], ...]
    """By person; frames whose pose replaced none are left out."""
    others: Mapping[int, Mapping[int, Array]]
    """The replaced poses, (n_values,), in the present body, by frame and index of the person."""
    stretches: tuple[Stretch, ...] = ()
    """Stretches on which the present poses are better or worse, by person; of a run as they were at its end."""
    run: int | None = None
    """Number of the tracking run that has just replaced the poses, counted since the start; None for another range."""
