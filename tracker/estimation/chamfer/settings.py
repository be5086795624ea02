"""Settings of the chamfer tracker, and the cost function and search that follow from them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.search.best_first import SearchSettings, SearchStep, search
from tracker.estimation.search.chamfer_cost import ChamferCost
from tracker.estimation.tracking.tracker import Subjects
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

Estimation = Literal["refine", "search"]


@dataclass(frozen=True)
class TrackSettings(EstimationSettings):
    """Settings of the chamfer tracker."""

    method: ClassVar[str] = "chamfer"
    """Name of the method, which the store keeps with the settings."""
    estimate: Estimation = "refine"
    """`refine` searches only where refinement does not suffice; `search` is best-first search alone, as in GD96."""
    search: SearchSettings = field(default_factory=SearchSettings)
    """Bounds, steps and stopping rule of the best-first search."""

    @property
    def settles_start(self) -> bool:
        """See `EstimationSettings.settles_start`; best-first search alone settles nothing."""
        return self.recover is not None and self.estimate == "refine"


def pose_cost(
    views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array], settings: TrackSettings,
    velocities: Sequence[Array | None] = (),
) -> ChamferCost:  # fmt: skip
    """Return the cost function around given poses, (n_values,) each: a search from them minimizes it.

    The velocities of the people, if given, move them to the time of each picture.
    """
    bodies = list(map(PosedBody, models, poses, velocities or [None] * len(poses)))
    return ChamferCost(views, bodies, settings.theta_px, settings.outliers)


def search_frame(
    views: Sequence[ViewEvidence],
    subjects: Subjects,
    predicted: Sequence[Array],
    settings: TrackSettings,
    velocities: Sequence[Array | None] = (),
) -> Iterator[SearchStep]:
    """Search the poses of one frame best first, step by step; see `search`.

    Args:
        views: the evidence of the frame.
        subjects: bodies, whom to search, and what may move; keyframes are not used.
        predicted: the pose of each person to begin from, (n_values,).
        settings: of the tracker.
        velocities: of each person, if known, see `pose_cost`.
    """
    cost = pose_cost(views, subjects.models, predicted, settings, velocities)
    active = [
        np.ones(m.n_dofs, dtype=bool) if a is None else a
        for m, a in zip(subjects.models, subjects.active_dofs, strict=True)
    ]
    return search(cost, predicted, settings.search, subjects.tracked, active)
