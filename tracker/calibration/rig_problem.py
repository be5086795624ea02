"""Least squares over cameras and what they see: normal equations of reprojection errors, robust, with weak priors.

Corrections of the cameras are the shared unknowns; each group of observations has its own ones, such as a free point or
the pose of a board. Squared errors s, in standard deviations of a picture, count as s / (1 + s / k^2) (Geman & McClure
1987), so that gross errors have no influence.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.calibration.camera_columns import camera_difference, moved_camera, n_columns, project_with_columns
from tracker.fitting.bundle import ArrowEquations, solve_bundle
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera

_OUTLIER_SIGMAS = 4.0
"""The k of the robust errors, standard deviations: Gaussian errors then keep 96% of their information (the ratio of
E[w + s w']^2 to E[w^2 s] / 2), and an error of 12 pulls as much as one of 1.2."""
_MEDIAN_SQUARE = 2 * np.log(2.0)
"""Median of the squared length of a Gaussian error in the plane, in variances."""
_ROUNDS = 12
"""Most fits with noise measured again in between. It settles to 1% within three to six."""
_SETTLED = 0.01
"""Largest relative change of the noise at which it has settled."""
_STEPS, _ROUGH, _FINAL = 2, 1e-2, 1e-6
"""Most steps before the noise is measured again, and relative decreases of the cost at which a fit ends: before the
noise has settled, and after."""
_MIN_SIGMA_PX = 0.01
"""Least standard deviation of a corner or a key point, px: none is found more precisely."""


@dataclass(frozen=True, eq=False)
class Observations:
    """Places at which cameras see points. They are sorted by camera and group."""

    cameras: IntArray
    """Index of the camera of each, (N,)."""
    groups: IntArray
    """Index of the group of each, such as the number of a free point or of the frame of a board, (N,)."""
    px: Array
    """Observed place, original px, (N, 2)."""

    def __post_init__(self) -> None:
        order = self.cameras.astype(np.int64) * (self.groups.max(initial=0) + 1) + self.groups
        assert np.all(np.diff(order) >= 0), "observations must be sorted by camera and group"

    def of_camera(self, camera: int) -> slice:
        """Return where the observations of a camera stand."""
        return slice(*np.searchsorted(self.cameras, [camera, camera + 1]))


class Rig(NamedTuple):
    """Unknowns of a problem: cameras, and the own unknowns of each group."""

    cameras: tuple[Camera, ...]
    own: Array
    """Free points, (G, 3), or poses, (G, 4, 4)."""


class Located(NamedTuple):
    """Observed points in the world."""

    points_world: Array
    """(N, 3), metres."""
    by_own: Array | None
    """Derivatives by the own unknowns of the group, (N, 3, m); None for free points, which are their own unknowns."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge of cameras before they are adjusted: Gaussian around a mean."""

    cameras: tuple[Camera, ...]
    """The means."""
    sigmas: tuple[Array, ...]
    """Standard deviations of the corrections of each camera, (n_columns,): 0 holds one, infinity leaves it free."""


class RigFit(NamedTuple):
    """Cameras and own unknowns at which the cost is least."""

    rig: Rig
    sigmas_px: Array
    """Measured standard deviation of an observation along each axis in each camera, (n_cameras,), px."""
    covariance: Array
    """Covariance of the corrections of all cameras, one after the other, (n, n); 0 for those that are held."""
    errors_px: Array
    """Projection minus observation, (N, 2), px."""
    weights: Array
    """Robust weight of each observation, 0 to 1, (N,)."""


class RigProblem:
    """Cameras that see the points of groups, for `solve_bundle`. Subclasses say where the points are."""

    n_own: int
    """Number of own unknowns of a group."""
    has_common_noise = False
    """Whether the ratios of the cameras' noise are given, and only its size is measured."""

    def __init__(self, observations: Observations, prior: Prior, n_groups: int, sigmas_px: Array) -> None:
        """State a problem.

        Args:
            observations: of all cameras.
            prior: knowledge of the cameras.
            n_groups: number of groups; each must be determined by its observations.
            sigmas_px: standard deviation of an observation in each camera, (n_cameras,), px.
        """
        self.observations, self.prior, self.n_groups, self.sigmas_px = observations, prior, n_groups, sigmas_px
        self.columns = [np.flatnonzero(sigmas > 0) for sigmas in prior.sigmas]
        self.ends = np.cumsum([0, *(len(columns) for columns in self.columns)])
        self.precision = np.concatenate([s[c] ** -2.0 for s, c in zip(prior.sigmas, self.columns, strict=True)])

    # --- for subclasses -----------------------------------------------------------------------------------------

    def locate(self, own: Array) -> Located:
        """Return where the observed points are."""
        raise NotImplementedError

    def move_own(self, own: Array, step: Array) -> Array:
        """Return the own unknowns after a step, (G, m)."""
        raise NotImplementedError

    # --- for the solver -----------------------------------------------------------------------------------------

    def linearize(self, rig: Rig) -> ArrowEquations:
        """See `BundleProblem`."""
        out, cost = ArrowEquations.zeros(int(self.ends[-1]), self.n_groups, self.n_own), 0.0
        located = self.locate(rig.own)
        for i, camera in enumerate(rig.cameras):
            at = self.observations.of_camera(i)
            by_own = None if located.by_own is None else located.by_own[at]
            cost += self._add_camera(out, i, camera, Located(located.points_world[at], by_own))
        moves = zip(self.prior.cameras, rig.cameras, self.columns, strict=True)
        offsets = np.concatenate([camera_difference(before, now)[columns] for before, now, columns in moves])
        out.gradient[:] += self.precision * offsets
        out.hessian[:] += np.diag(self.precision)
        return out._replace(cost=cost + 0.5 * float(self.precision @ offsets**2))

    def _add_camera(self, out: ArrowEquations, index: int, camera: Camera, located: Located) -> float:
        """Add the equations of one camera; return its cost."""
        J, own, r, cost = self._scaled_rows(index, camera, located)
        part, flat = slice(self.ends[index], self.ends[index + 1]), J.reshape(-1, J.shape[2])
        out.gradient[part] += flat.T @ r.ravel()
        out.hessian[part, part] += flat.T @ flat
        groups, transposed = self.observations.groups[self.observations.of_camera(index)], own.swapaxes(1, 2)
        _add(out.own_gradients, groups, (transposed @ r)[..., 0])
        _add(out.own_hessians, groups, transposed @ own)
        _add(out.cross[:, :, part], groups, transposed @ J)
        return cost

    def _scaled_rows(self, index: int, camera: Camera, located: Located) -> tuple[Array, Array, Array, float]:
        """Return rows in standard deviations, weighted, and the cost of a camera.

        Returns:
            Derivatives by the camera, (N, 2, n), and by the own unknowns, (N, 2, m); errors, (N, 2, 1); half the sum of
            robust squares. Points that the camera does not show have rows of 0 and the largest robust square.
        """
        sigma = self.sigmas_px[index]
        found = project_with_columns(camera, located.points_world)
        errors = found.px - self.observations.px[self.observations.of_camera(index)]
        s = np.sum(errors**2, axis=1) / sigma**2
        shown = np.isfinite(s)
        scale = np.sqrt(np.where(shown, _weights(s), 0.0)) / sigma
        J, own = found.by_camera[:, :, self.columns[index]], found.by_point
        if not shown.all():
            J, own, errors = (np.where(np.isfinite(rows), rows, 0.0) for rows in (J, own, errors))
        if located.by_own is not None:
            own = own @ located.by_own
        cost = 0.5 * float(np.where(shown, s / (1 + s / _OUTLIER_SIGMAS**2), _OUTLIER_SIGMAS**2).sum())
        scale = scale[:, None, None]
        return J * scale, own * scale, errors[:, :, None] * scale, cost

    def moved(self, rig: Rig, shared: Array, own: Array) -> Rig:
        """See `BundleProblem`."""
        cameras = tuple(moved_camera(c, self.step_of(i, shared)) for i, c in enumerate(rig.cameras))
        return Rig(cameras, self.move_own(rig.own, own))

    def free(self, rig: Rig, equations: ArrowEquations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """See `BundleProblem`."""
        return np.ones(len(self.precision), dtype=bool), np.ones((self.n_groups, self.n_own), dtype=bool)

    def step_of(self, camera: int, shared: Array) -> Array:
        """Return the correction of one camera, (n_columns,), of a step of the shared unknowns, (n,)."""
        out = np.zeros(n_columns(self.prior.cameras[camera]))
        out[self.columns[camera]] = shared[self.ends[camera] : self.ends[camera + 1]]
        return out

    # --- noise --------------------------------------------------------------------------------------------------

    def errors_px(self, rig: Rig) -> Array:
        """Return projection minus observation, (N, 2), px; NaN where a camera does not show the point."""
        points = self.locate(rig.own).points_world
        parts = [self.observations.of_camera(i) for i in range(len(rig.cameras))]
        return np.concatenate(
            [c.project(points[at]) - self.observations.px[at] for c, at in zip(rig.cameras, parts, strict=True)]
        )

    def measured_sigmas_px(self, rig: Rig) -> Array:
        """Measure the standard deviation of an observation in each camera by the median error, (n_cameras,), px.

        Free points can be moved onto what a single camera observes, so that its errors alone do not tell its noise. The
        ratios of the cameras' noise then stay as they are.
        """
        squares = np.nan_to_num(np.sum(self.errors_px(rig) ** 2, axis=1), nan=np.inf)
        if self.has_common_noise:
            scale2 = np.median(squares / self.sigmas_px[self.observations.cameras] ** 2) / _MEDIAN_SQUARE
            return np.maximum(self.sigmas_px * np.sqrt(scale2 / self.left), _MIN_SIGMA_PX)
        parts = [squares[self.observations.of_camera(i)] for i in range(len(rig.cameras))]
        medians = np.array([np.median(part) if len(part) else _MEDIAN_SQUARE for part in parts])
        return np.maximum(np.sqrt(medians / _MEDIAN_SQUARE / self._left_in_cameras(rig)), _MIN_SIGMA_PX)

    @property
    def left(self) -> float:
        """Share of the squared errors that a fit leaves, 0 to 1: one less the unknowns over the observed numbers."""
        spent = self.n_groups * self.n_own + len(self.precision)
        return max(1.0, 2 * len(self.observations.px) - spent) / (2 * len(self.observations.px))

    def _left_in_cameras(self, rig: Rig) -> Array:
        """Return the same share of the errors in each camera, (n_cameras,), by the leverage of its observations."""
        equations, located = self.linearize(rig), self.locate(rig.own)
        inverse = np.linalg.pinv(equations.own_hessians, hermitian=True)
        out = np.ones(len(rig.cameras))
        for i, camera in enumerate(rig.cameras):
            at = self.observations.of_camera(i)
            if at.start == at.stop:
                continue
            by_own = None if located.by_own is None else located.by_own[at]
            own = self._scaled_rows(i, camera, Located(located.points_world[at], by_own))[1]
            leverage = np.einsum("nij,njk,nik->", own, inverse[self.observations.groups[at]], own)
            spent = leverage + len(self.columns[i])
            n = 2 * (at.stop - at.start)
            out[i] = max(1.0, n - spent) / n
        return out

    def with_sigmas(self, sigmas_px: Array) -> "RigProblem":
        """Return the problem with other standard deviations."""
        out = object.__new__(type(self))
        out.__dict__ = {**self.__dict__, "sigmas_px": sigmas_px}
        return out


def fit_rig(problem: RigProblem, rig: Rig) -> RigFit:
    """Fit cameras and own unknowns, and measure the noise between fits until it settles."""
    for _ in range(_ROUNDS):
        sigmas = problem.measured_sigmas_px(rig)
        is_settled = np.allclose(sigmas, problem.sigmas_px, rtol=_SETTLED)
        problem = problem.with_sigmas(sigmas)
        rig = solve_bundle(problem, rig, _STEPS, _ROUGH).state
        if is_settled:
            break
    rig = solve_bundle(problem, rig, tolerance=_FINAL).state
    return _result(problem, rig)


def _result(problem: RigProblem, rig: Rig) -> RigFit:
    equations, errors = problem.linearize(rig), problem.errors_px(rig)
    squares = np.sum(errors**2, axis=1) / problem.sigmas_px[problem.observations.cameras] ** 2
    squares = np.nan_to_num(squares, nan=np.inf)
    weights, prior = _weights(squares), np.diag(problem.precision)
    data = equations._replace(hessian=equations.hessian - prior).reduced()[1]
    precision = _information(squares, weights, problem.left) * data + prior
    # The columns have different units.
    units = 1 / np.sqrt(np.maximum(np.diag(precision), np.finfo(float).tiny))
    covariance = np.linalg.pinv(precision * np.outer(units, units), hermitian=True) * np.outer(units, units)
    at = np.concatenate([start + c for start, c in zip(column_ends(rig.cameras), problem.columns, strict=False)])
    whole = np.zeros(2 * (column_ends(rig.cameras)[-1],))
    whole[np.ix_(at, at)] = covariance
    return RigFit(rig, problem.sigmas_px, whole, errors, weights)


def column_ends(cameras: Sequence[Camera]) -> list[int]:
    """Return where the corrections of each camera begin among those of all, and where the last ones end."""
    return [0, *itertools.accumulate(n_columns(c) for c in cameras)]


def _information(squares: Array, weights: Array, left: float) -> float:
    """Return the true information of robust errors over that of the weighted normal equations (Huber 1981, Sect. 7.6).

    Args:
        squares: squared errors in variances, (N,).
        weights: their robust weights, (N,).
        left: share of the squared errors that the fit has left.
    """
    s = np.where(np.isfinite(squares), squares, 0.0)
    slopes = weights * (1 - 2 * s / (_OUTLIER_SIGMAS**2 + s))  # w + s dw/ds
    variance = np.mean(weights**2 * s) / 2 / left
    return float(np.mean(slopes) ** 2 / (variance * np.mean(weights)))


def _weights(squares: Array) -> Array:
    return np.asarray(1 / (1 + squares / _OUTLIER_SIGMAS**2) ** 2)


def _add(target: Array, groups: IntArray, values: Array) -> None:
    """Add values, (N, ...), to the rows of their groups, which are sorted."""
    if len(groups):
        first = np.flatnonzero(np.diff(groups, prepend=-1))
        target[groups[first]] += values if len(first) == len(groups) else np.add.reduceat(values, first, axis=0)
