"""The minimization of KRH08 on one frame as the steps of a search, to be watched and replayed.

The minimization of KRH08 Sect. 5.3 by itself, iteration by iteration: for experiments and for the page.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import groupby
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.body.parts import SearchGroup
from tracker.compute.jit import FAR
from tracker.estimation.by_frame.incremental_fit import fit_by_chains, fit_chains
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, TOLERANCE
from tracker.estimation.contour.image_contours import with_unlimited_distances
from tracker.estimation.contour.paper import paper_settings
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals, paper_match
from tracker.estimation.fitting.gauss_newton import iterate
from tracker.estimation.search.best_first import SearchStep, Stage
from tracker.evidence.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray

START = "start"
"""Name of the pose before the first iteration."""


class FitIteration(NamedTuple):
    """A pose on the way of a minimization."""

    name: str
    """Name: "start", then "iteration 3", or a step of an incremental fit, such as "left arm"."""
    pose: Array
    """(n_values,)."""
    rms_px: float
    """RMS distance of the contours to the image contours, px; NaN where nothing is visible."""
    cost: float
    """Half the sum of squared distances over the length of the contours, px^3."""


def unlimited_views(views: Sequence[ViewEvidence], settings: ContourSettings) -> list[ViewEvidence]:
    """Return views whose distance images have no limit, as KRH08 Eq. 60 needs them."""
    return [with_unlimited_distances(v, settings.image_contours) for v in views]


def paper_residuals(
    unlimited: Sequence[ViewEvidence], bodies: Sequence[PosedBody], person: int, settings: ContourSettings
) -> ContourResiduals:
    """Return the residuals of KRH08 Eq. 60 of one person: model to image, plain squares.

    Args:
        unlimited: see `unlimited_views`.
        bodies: all people who may occlude, the person included.
        person: index of the person among them.
        settings: whether the sliding term is part of the Jacobian.
    """
    motion: Literal["rigid", "sliding"] = "sliding" if settings.sliding else "rigid"
    return ContourResiduals(unlimited, bodies, person, paper_match(motion), float(FAR), everywhere=True)


def fit_by_iterations(
    model: BodyModel, start: Array, residuals: ContourResiduals, most: int, active_dofs: NDArray[np.bool_] | None = None
) -> Iterator[FitIteration]:
    """Minimize from a start pose, one Gauss-Newton iteration after the other.

    Args:
        model: the body.
        start: (n_values,).
        residuals: see `paper_residuals`.
        most: largest number of iterations.
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Yields:
        The start, then the pose after each iteration that lowers the cost.
    """
    last = None
    for fit in iterate(model, start, [residuals], active_dofs, most, TOLERANCE):
        if last is None or fit.cost < last:
            name = START if last is None else f"iteration {fit.iterations}"
            yield FitIteration(name, fit.pose, _rms_px(residuals, fit.pose, fit.cost), fit.cost)
        last = fit.cost


def fit_incrementally(model: BodyModel, start: Array, residuals: ContourResiduals) -> Iterator[FitIteration]:
    """Fit a rough guess chain by chain (KRH08 Sect. 6, Fig. 9). Yields the start, then each step."""
    yield rms_at(model, start, residuals, START)
    for step in fit_by_chains(model, start, [residuals]):
        yield FitIteration(step.name, step.fit.pose, _rms_px(residuals, step.fit.pose, step.fit.cost), step.fit.cost)


def rms_at(model: BodyModel, pose: Array, residuals: ContourResiduals, name: str) -> FitIteration:
    """Measure the distances of a body in a pose, (n_values,), that something else found."""
    cost = residuals.linearize(model, pose, model.kinematics(pose)).cost
    return FitIteration(name, pose, _rms_px(residuals, pose, cost), cost)


def _rms_px(residuals: ContourResiduals, pose: Array, cost: float) -> float:
    """Return the RMS distance of a cost, which is half the sum of squares over the length of the contour."""
    length_px = float(residuals.part_costs(pose).length_px.sum())
    return float(np.sqrt(2 * cost / length_px)) if length_px > 0 else np.nan


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
