"""The rows of `quadrille bench` about the contour tracker: an iteration, a complete solve and scipy's, the pipeline."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from app.bench.rows import BenchScene, Row, Yardstick, descended, pipeline_row
from app.bench.sample_frames import BenchFrame
from tracker.body.model import PosedBody
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import ContourResiduals
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.geometry.arrays import Array, FloatArray
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.estimation.settings import TOLERANCE

_SETTINGS = ContourSettings()
_FASTER, _AIM_FASTER = 20.0, 40.0
"""How many times faster than scipy a complete solve must be, and should be."""


def extremal_contours(six: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """One symmetric iteration with the sliding term, 54 degrees of freedom in 6 views; and a complete solve."""
    model, start = six.model, six.near_prediction()
    what = f"{model.n_dofs} degrees of freedom, {len(model.parts)} cones, {len(six.views)} views"
    match = ContourResiduals(six.views, [PosedBody(model, start)], settings=_SETTINGS.match)
    steps = np.random.default_rng(3).normal(scale=0.005, size=(50, model.n_dofs))
    poses = [model.retract(start, step) for step in steps]
    few, many = (partial(descended, model, match, poses, n) for n in (2, 6))
    n, timed = many() - few(), yardstick.beside_difference(many, few, 30)
    timed = timed._replace(work_us=timed.work_us / n)
    yield Row("contour_iteration", f"iteration of the contour tracker, {what}", *timed, 1 / 3, 1 / 5)
    yield from _solves(six, match, what, yardstick)


def _solves(six: BenchFrame, match: ContourResiduals, what: str, yardstick: Yardstick) -> Iterator[Row]:
    """A complete solve, and scipy's from the same start. The final costs of both are those that scipy minimizes."""
    model, start = six.model, six.near_prediction()
    edges_px = six.cost(start).edge_points_px

    def distances(pose: Array) -> Array:
        return np.concatenate(nearest_distances(six.views, edges_px, PosedBody(model, pose)))

    def rms_px(pose: Array) -> float:
        return float(np.sqrt(np.mean(distances(pose) ** 2)))

    def solve() -> Array:
        return solve_compiled(model, start, [match], None, _SETTINGS.max_iterations, TOLERANCE).pose

    found = list[Array]()

    def solve_by_scipy() -> None:
        low, high = model.limits.T
        inside = np.clip(start, low + 1e-6, high - 1e-6)
        found.append(np.asarray(least_squares(distances, inside, bounds=(low, high), ftol=1e-4).x))

    scipy, timed = yardstick.beside(solve_by_scipy, 1), yardstick.beside(solve, 15)
    ours_px, theirs_px = rms_px(solve()), rms_px(found[-1])
    by_scipy = Row("contour_solve_scipy", "the same by scipy's least_squares with numeric Jacobian", *scipy)
    ours = Row("contour_solve", f"complete solve of the contour tracker, {what}", *timed)
    # Both minimize different costs, so a solve that ends farther from the edges than scipy's does not count.
    if ours_px > theirs_px:
        yield ours._replace(must=0.0, aim=0.0, note=f"edges {ours_px:.2f} px off, by scipy only {theirs_px:.2f}")
        yield by_scipy
        return
    scipy_ratio = by_scipy.time_us / ours.yardstick_us  # both times are long; a yardstick beside one run is not
    yield ours._replace(
        must=scipy_ratio / _FASTER, aim=scipy_ratio / _AIM_FASTER,
        note=f"{scipy_ratio / ours.ratio:.0f} times as fast; edges {ours_px:.2f} px off, by scipy {theirs_px:.2f}",
    )  # fmt: skip
    yield by_scipy


def nearest_distances(views: Sequence[ViewEvidence], edges_px: Sequence[FloatArray], body: PosedBody) -> list[Array]:
    """Return the distances of edge points, (n, 2) px, to the nearest visible contour, cut off, (n,) for each view."""
    out = list[Array]()
    for view, points_px in zip(views, edges_px, strict=True):
        seen = occluding_contours.trace([body], view.camera)
        pieces = seen.pieces_px[~seen.occluded].astype(np.float64)
        if not len(pieces):
            out.append(np.full(len(points_px), view.theta_px))
            continue
        starts, steps = pieces[:, :2], pieces[:, 2:] - pieces[:, :2]
        nearest = cKDTree(starts + 0.5 * steps).query(points_px)[1]
        starts, steps = starts[nearest], steps[nearest]
        lengths2 = np.maximum(np.sum(steps**2, axis=1), 1e-12)
        along = np.clip(np.sum((points_px - starts) * steps, axis=1) / lengths2, 0.0, 1.0)
        feet = starts + along[:, None] * steps
        out.append(np.minimum(np.linalg.norm(points_px - feet, axis=1), view.theta_px))
    return out


def pipelines(frame: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """From video to overlay with `gavrila34`: by the chamfer tracker, and by the contour tracker at least as fast."""
    scene = BenchScene(frame.session, (frame.model,), (frame.joints,))
    by_chamfer = pipeline_row("pipeline_gavrila34", scene, TrackSettings(), yardstick)
    yield by_chamfer
    row = pipeline_row("pipeline_gavrila34_contour", scene, _SETTINGS, yardstick)
    yield row._replace(must=by_chamfer.ratio, aim=by_chamfer.ratio / 1.1)
