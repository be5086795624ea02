"""The minimization of KRH08 on one frame as the steps of a search, to be watched and replayed."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.body.parts import SearchGroup
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray
from tracker.search.best_first import SearchStep, Stage
from tracker.tracking.contour.image_contours import with_unlimited_distances
from tracker.tracking.contour.paper import paper_settings
from tracker.tracking.contour.paper_fit import FitIteration, fit_by_iterations, paper_residuals, unlimited_views

_SETTINGS = paper_settings()
_STRIDE = 4
"""One residual is drawn for so many pieces of contour."""


class FitPlan(NamedTuple):
    """Whom to fit, one after the other."""

    models: Sequence[BodyModel]
    """The body of each person."""
    active_dofs: Sequence[NDArray[np.bool_]]
    """The degrees of freedom of each person that may move, (n_dofs,) each."""

    @property
    def stages(self) -> list[Stage]:
        """One stage for each person who may move."""
        return [
            Stage(p, SearchGroup("contours", tuple(np.array(m.dof_names)[active])), 1.0)
            for p, (m, active) in enumerate(zip(self.models, self.active_dofs, strict=True))
            if active.any()
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
        iterations.
    """
    unlimited, now, done = unlimited_views(views, _SETTINGS), tuple(poses), 0
    for stage in plan.stages:
        person, model = stage.person, plan.models[stage.person]
        bodies = [PosedBody(m, pose) for m, pose in zip(plan.models, now, strict=True)]
        residuals = paper_residuals(unlimited, bodies, person, _SETTINGS)
        active, most = plan.active_dofs[person], _SETTINGS.max_iterations
        first: FitIteration | None = None
        waiting: FitIteration | None = None
        for i in fit_by_iterations(model, now[person], residuals, most, active):
            first = first or i
            if waiting is not None:
                yield _step(stage, now, _relative(waiting, first), done, False, len(views))
                done += 1
            waiting, now = i, (*now[:person], i.pose, *now[person + 1 :])
        if waiting is not None and first is not None:
            yield _step(stage, now, _relative(waiting, first), done, True, len(views))


def _relative(now: FitIteration, first: FitIteration) -> FitIteration:
    """Return an iteration with the RMS distance over the length of the contours at the start."""
    return now._replace(rms_px=first.rms_px * float(np.sqrt(now.cost / first.cost)) if first.cost > 0 else now.rms_px)


def _step(
    stage: Stage, poses: tuple[Array, ...], found: FitIteration, done: int, last: bool, n_views: int
) -> SearchStep:
    at = (*poses[: stage.person], found.pose, *poses[stage.person + 1 :])
    return SearchStep(stage, at, found.rms_px, at, found.rms_px, np.full(n_views, np.nan), done, last)


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
