"""The minimization of KRH08 on one frame as the steps of a search, to be watched and replayed."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.body.parts import SearchGroup
from tracker.estimation.by_frame.incremental_fit import fit_chains
from tracker.estimation.by_frame.settings import MAX_ITERATIONS
from tracker.estimation.contour.image_contours import with_unlimited_distances
from tracker.estimation.contour.paper import paper_settings
from tracker.estimation.contour.paper_fit import (
    START,
    FitIteration,
    fit_by_iterations,
    paper_residuals,
    unlimited_views,
)
from tracker.estimation.search.best_first import SearchStep, Stage
from tracker.evidence.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray

_SETTINGS = paper_settings()
_STRIDE = 4
"""One residual is drawn for so many pieces of contour."""


class FitPlan(NamedTuple):
    """The people to fit in their order, and whether each is fitted chain by chain."""

    models: Sequence[BodyModel]
    """The body of each person."""
    active_dofs: Sequence[NDArray[np.bool_]]
    """The degrees of freedom of each person that may move, (n_dofs,) each."""
    by_chains: bool = False
    """Whether a rough pose is fitted chain by chain (KRH08 Sect. 6), not all joints at once."""

    @property
    def stages(self) -> list[Stage]:
        """One stage for each person who may move; by chains one for each chain that may."""
        return [
            Stage(p, SearchGroup(name, tuple(np.array(m.dof_names)[dofs & active])), 1.0)
            for p, (m, active) in enumerate(zip(self.models, self.active_dofs, strict=True))
            for name, dofs in (fit_chains(m) if self.by_chains else [("contours", active)])
            if (dofs & active).any()
        ]


def contour_steps(views: Sequence[ViewEvidence], poses: Sequence[Array], plan: FitPlan) -> Iterator[SearchStep]:
    """Fit people to the image contours of a frame, each with the others where they are; a step for each iteration.

    Args:
        views: the evidence of the frame.
        poses: pose of each person to begin from, (n_values,).
        plan: whom to fit.

    Yields:
        The start and every iteration. Costs are RMS distances of the contours of the person who is fitted, px, over
        their length at the start, so that they fall as the minimized sum does. The number of evaluations is that of
        iterations. Of the chains of a person, only the first has a step for its start.
    """
    unlimited, now, done = unlimited_views(views, _SETTINGS), tuple(poses), 0
    most = MAX_ITERATIONS if plan.by_chains else _SETTINGS.max_iterations
    for person, stages in groupby(plan.stages, key=lambda stage: stage.person):
        model, first = plan.models[person], None
        bodies = [PosedBody(m, pose) for m, pose in zip(plan.models, now, strict=True)]
        residuals = paper_residuals(unlimited, bodies, person, _SETTINGS)
        for stage in stages:
            active = np.isin(model.dof_names, stage.group.dofs)
            for i, is_last in _with_last(fit_by_iterations(model, now[person], residuals, most, active)):
                is_start = i.name == START
                if is_start and first is not None and not is_last:
                    continue
                first, done = first or i, done + (not is_start)
                now = (*now[:person], i.pose, *now[person + 1 :])
                # The length of the contours is that at the start, so that the distance falls with the cost.
                px = first.rms_px * float(np.sqrt(i.cost / first.cost)) if first.cost > 0 else i.rms_px
                yield SearchStep(stage, now, px, now, px, done, is_last)


def _with_last(iterations: Iterator[FitIteration]) -> Iterator[tuple[FitIteration, bool]]:
    """Pair each iteration with whether it is the last."""
    now = next(iterations)
    for after in iterations:
        yield now, False
        now = after
    yield now, True


def residual_segments(bodies: Sequence[PosedBody], view: ViewEvidence) -> FloatArray:
    """Return lines from the visible contours to the image contours that they are drawn to, (N, 4), undistorted px.

    Each goes down the slope of the distance image, as far as the distance.
    """
    distance = _unlimited(view).distance
    contour = occluding_contours.trace(bodies, view.camera)
    ends = contour.pieces_px[~contour.occluded][::_STRIDE]
    middles = (ends[:, :2] + ends[:, 2:]) / 2
    at = np.rint(middles).astype(np.intp)
    inside = np.all((at >= 1) & (at < np.array(view.camera.size) - 1), axis=1)
    middles, (u, v) = middles[inside], at[inside].T
    slope = np.stack([distance[v, u + 1] - distance[v, u - 1], distance[v + 1, u] - distance[v - 1, u]], axis=1)
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    toward = np.divide(slope, length, out=np.zeros_like(slope), where=length > 0)
    lines = np.hstack([middles, middles - distance[v, u][:, None] * toward])
    # Resizing keeps the borders of pixels, not their centres.
    return ((lines + np.tile(view.corner_px, 2) + 0.5) / view.scale - 0.5).astype(np.float32)


@lru_cache(maxsize=16)
def _unlimited(view: ViewEvidence) -> ViewEvidence:
    """Cached: the evidence of a frame stays while its iterations are replayed."""
    return with_unlimited_distances(view, _SETTINGS.image_contours)
