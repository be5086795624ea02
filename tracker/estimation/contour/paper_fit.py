"""The minimization of KRH08 Sect. 5.3 by itself, iteration by iteration: for experiments and for the page."""

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.float32 import FAR
from tracker.estimation.by_frame.incremental_fit import fit_by_chains
from tracker.estimation.by_frame.settings import TOLERANCE
from tracker.estimation.contour.image_contours import with_unlimited_distances
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals, paper_match
from tracker.estimation.fitting.gauss_newton import iterate
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

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
