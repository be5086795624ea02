"""The rows of `quadrille bench` about the contour tracker: 54 degrees of freedom, 19 parts and six views."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from app.bench.rows import Row, Timed, Yardstick, descended, tracked_pipeline
from app.bench.sample_frames import BenchFrame
from tracker.body.model import PosedBody
from tracker.estimation.by_frame.settings import TOLERANCE
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import Fit, PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled
from tracker.evidence.contours import occluding_contours
from tracker.geometry.arrays import Array

_MUST, _AIM = 3.0, 4.0
"""Iterations in the time of a yardstick."""
_FASTER = 20.0
"""Complete solves in the time of one by scipy that ends at the same cost."""
_AIM_FASTER = 50.0
_SAME_COST = 1.01
"""Costs that differ by less than this factor count as equal."""
_SETTINGS = ContourSettings()


def iteration(six: BenchFrame, yardstick: Yardstick) -> Row:
    """One iteration of the symmetric Gauss-Newton with the motion of contour points in full."""
    start, model = six.near_prediction(), six.model
    match = ContourResiduals(six.views, [PosedBody(model, start)], settings=_SETTINGS.match)
    steps = np.random.default_rng(3).normal(scale=0.005, size=(50, model.n_dofs))
    poses = [model.retract(start, step) for step in steps]
    few, many = (partial(descended, model, match, poses, n) for n in (2, 6))
    n, timed = many() - few(), yardstick.beside_difference(many, few, 30)
    timed = timed.scaled(1 / n)
    what = f"contour iteration, {model.n_dofs} DOF, {len(model.parts)} parts, {len(six.views)} views"
    return Row("contour_iteration", what, *timed, 1 / _MUST, 1 / _AIM)


def solves(six: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """A complete solve as the tracker does it, and one by scipy until its cost is the same."""
    model, start = six.model, six.near_prediction()
    match = ContourResiduals(six.views, [PosedBody(model, start)], settings=_SETTINGS.match)
    blocks: list[ResidualBlock] = [match, PosePrior(start, 1 / model.spreads)]

    def solve() -> Fit:
        return solve_compiled(model, start, blocks, None, _SETTINGS.max_iterations, TOLERANCE)

    timed, fit = yardstick.beside(solve, 15), solve()
    by_scipy = _Scipy(six, start)
    wanted = by_scipy.rms_px(fit.pose)
    scipy_timed = yardstick.beside(partial(by_scipy.solve, _SAME_COST * wanted), 1)
    what = "the same by scipy's least_squares with numeric Jacobian, edges to contour"
    scipy_row = Row("contour_solve_scipy", what, *scipy_timed, note=f"ends at {by_scipy.best_px:.2f} px")
    must, aim = scipy_row.ratio / _FASTER, scipy_row.ratio / _AIM_FASTER
    note = f"{fit.iterations} iterations, from {by_scipy.rms_px(start):.2f} to {wanted:.2f} px"
    yield Row("contour_solve", f"contour solve, {model.n_dofs} DOF, {len(six.views)} views", *timed, must, aim, note)
    yield scipy_row


class _EndedError(Exception):
    """Ends a solve of scipy."""


class _Scipy:
    """Distances of all edge points to the nearest visible contour, minimized by scipy."""

    def __init__(self, frame: BenchFrame, start: Array) -> None:
        self._frame, self._start = frame, start
        self._edges_px = frame.cost(start).edge_points_px
        self.best_px = np.inf
        """Least RMS distance so far, px."""

    def residuals(self, values: Array) -> Array:
        """Return the distances, (n,), px, cut off at theta."""
        out, body = list[Array](), PosedBody(self._frame.model, values)
        for view, points_px in zip(self._frame.views, self._edges_px, strict=True):
            contour = occluding_contours.trace([body], view.camera)
            pieces = contour.pieces_px[~contour.occluded]
            middles = 0.5 * (pieces[:, :2] + pieces[:, 2:])
            far = np.full(len(points_px), view.theta_px)
            out.append(np.minimum(cKDTree(middles).query(points_px)[0], far) if len(middles) else far)
        return np.concatenate(out)

    def rms_px(self, values: Array) -> float:
        """Return the root of the mean square of the distances, px."""
        return float(np.sqrt(np.mean(self.residuals(values) ** 2)))

    def solve(self, enough_px: float) -> None:
        """Minimize until the RMS distance is low enough, or scipy ends."""
        self.best_px = np.inf

        def watched(values: Array) -> Array:
            found = self.residuals(values)
            self.best_px = min(self.best_px, float(np.sqrt(np.mean(found**2))))
            if self.best_px <= enough_px:
                raise _EndedError
            return found

        try:
            least_squares(watched, self._start, method="trf", diff_step=[1e-4], max_nfev=50)
        except _EndedError:
            return


def pipelines(frame: BenchFrame, yardstick: Yardstick) -> Iterator[Row]:
    """From video to overlay with `gavrila34`, by the chamfer tracker and by the contour tracker."""
    models, joints = [frame.model], [frame.joints]

    def timed(settings: TrackSettings | ContourSettings) -> tuple[Timed, str]:
        return tracked_pipeline(settings, frame.session, models, joints, yardstick)

    chamfer, note = timed(TrackSettings())
    row = Row("pipeline_34", "video to overlay, gavrila34, chamfer tracker", *chamfer, note=note)
    yield row
    contour, note = timed(_SETTINGS)
    what = "video to overlay, gavrila34, contour tracker"
    yield Row("pipeline_34_contour", what, *contour, row.ratio, 0.8 * row.ratio, note)
