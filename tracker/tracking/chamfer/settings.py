"""What the chamfer tracker is told, and what follows from it: the cost of poses, their search, what holds them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import MatchSettings
from tracker.fitting.gauss_newton import PosePrior, ResidualBlock
from tracker.fitting.interpenetration import SelfPenetration
from tracker.geometry.arrays import Array
from tracker.motion.prediction import PredictSettings
from tracker.search.best_first import SearchSettings, SearchStep, search
from tracker.search.chamfer_cost import ChamferCost, Outliers
from tracker.tracking.chamfer.limb_recovery import RecoverSettings

Estimation = Literal["refine", "search"]


@dataclass(frozen=True)
class TrackSettings:
    """What the chamfer tracker is told."""

    method: ClassVar[str] = "chamfer"
    """Name of the method, which the store keeps with the settings."""
    estimate: Estimation = "refine"
    """`refine` searches only where refinement does not suffice; `search` is best-first search alone, as in GD96."""
    predict: PredictSettings = field(default_factory=PredictSettings)
    """Motion model."""
    match: MatchSettings = field(default_factory=MatchSettings)
    """How contours and edges pull in the refinement."""
    search: SearchSettings = field(default_factory=SearchSettings)
    """Bounds, steps and stopping rule of the best-first search."""
    recover: RecoverSettings | None = field(default_factory=RecoverSettings)
    """How lost limbs are searched for; None leaves them."""
    theta_px: float | None = None
    """Outlier distance, px of the footage; None for 3% of the longer side of each image."""
    outliers: Outliers = "truncated"
    """How the search treats outliers, see `ChamferCost`."""
    segments: bool = True
    """Whether edges count only in segments that the prediction accepts as wholes (GD96 Sect. 4.2), and never those
    that stand still away from everybody."""
    trust_rad: float = 0.15
    """Standard deviation of the prediction of an angle, rad."""
    trust_m: float = 0.05
    """Standard deviation of the prediction of a position, metres."""
    occlusion: bool = True
    """Whether people hide each other and share out the edges; else each is tracked as if nobody else were there."""
    rounds: int = 2
    """Rounds of the joint refinement, in which each person is refined once more with the others where they were found,
    at most; 0 leaves everybody as they were found one after the other."""
    second_pass: bool = True
    """Whether whoever tracking lost is followed back from the first trusted poses after it, see `second_pass`."""
    apart: float = 1.0
    """Weight of what keeps people from passing through each other; 0 lets them."""


def pose_cost(
    views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array], settings: TrackSettings
) -> ChamferCost:
    """Make the cost function around given poses: what a search from them minimizes."""
    bodies = [PosedBody(m, p) for m, p in zip(models, poses, strict=True)]
    return ChamferCost(views, bodies, settings.theta_px, settings.outliers)


def search_frame(
    views: Sequence[ViewEvidence],
    models: Sequence[BodyModel],
    predicted: Sequence[Array],
    settings: TrackSettings,
    people: Sequence[int] | None = None,
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[SearchStep]:
    """Search the poses of one frame from their prediction, step by step; see `search`."""
    cost = pose_cost(views, models, predicted, settings)
    return search(cost, predicted, settings.search, people, free)


def prior_blocks(model: BodyModel, expected: Array, sigmas: Array) -> list[ResidualBlock]:
    """What holds a pose besides the image: the one that is expected, how people bend, and that flesh keeps apart.

    Args:
        model: the body.
        expected: the pose, (n_values,).
        sigmas: its standard deviations, (n_dofs,), rad or metres.
    """
    return [PosePrior(expected, 1 / sigmas), PosePrior(model.neutral(), 1 / model.spreads), SelfPenetration()]
