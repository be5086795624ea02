"""Least squares over cameras and what they see: normal equations of reprojection errors, robust, with weak priors.

Corrections of the cameras are the shared unknowns; each group of observations has its own ones, such as a free point or
the pose of a board. Squared errors s, in standard deviations of a picture, count as s / (1 + s / k^2) (Geman & McClure
1987), so that gross errors have no influence.
"""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tracker.calibration.check.lens_priors import CALIBRATED
from tracker.estimation.fitting.bundle import ROUGH, ArrowEquations, solve_bundle
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.camera_derivatives import (
    FOCAL,
    ProjectionDerivatives,
    camera_difference,
    moved_camera,
    n_camera_parameters,
    project_with_columns,
)
from tracker.geometry.cameras import Camera

OUTLIER_SIGMAS = 4.0
"""The k of the robust errors, standard deviations: Gaussian errors then keep 96% of their information (the ratio of
E[w + s w']^2 to E[w^2 s] / 2), and an error of 12 pulls as much as one of 1.2."""
_MEDIAN_SQUARE = 2 * np.log(2.0)
"""Median of the squared length of a Gaussian error in the plane, in variances."""
_ROUNDS = 12
"""Most fits with noise measured again in between. It settles to 1% within three to six."""
_SETTLED = 0.01
"""Largest relative change of the noise at which it has settled: 1% of all intervals."""
_STEPS, _FINAL = 2, 1e-6
"""Most steps before the noise is measured again, and the relative decrease of the cost at which a fit ends once the
noise has settled."""
_LARGE, _FALL = 0.95, 4.0
"""Quantile of the errors that the noise begins at, and the factor by which it falls at most from fit to fit."""
_NOT_SHOWN_PX = 1e4
"""Error of a point that its camera does not show, px: larger than a picture."""
_FLOOR = 1e-8
"""Added to second derivatives by own unknowns, 1 / rad^2 or 1 / m^2: groups whose observations are all gross errors
stay where they are."""
_PLAIN_PX = 1000.0
"""Noise beside which no error is gross, px: the width of a picture. Errors of 10 px then keep their weight to 1e-5."""
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

    def of_groups(self, chosen: Mask) -> "Observations":
        """Return the observations of chosen groups, (G,), with numbers from 0 on without gaps."""
        at, numbers = chosen[self.groups], np.cumsum(chosen) - 1
        return Observations(self.cameras[at], numbers[self.groups[at]], self.px[at])


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
    alike: tuple[tuple[int, ...], ...] = ()
    """Cameras with lenses of one model and free focal lengths, which differ by a percent."""

    @classmethod
    def held(cls, cameras: Sequence[Camera]) -> "Prior":
        """Return the knowledge of cameras that stay."""
        return cls(tuple(cameras), tuple(np.zeros(n_camera_parameters(c)) for c in cameras))


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
    variance_inflation: float
    """By how much errors of one view agree, at least 1; see `ReprojectionProblem.variance_inflation`."""

    @property
    def focal_sigmas(self) -> Array:
        """Standard deviation of each focal length, as a share of it, (n_cameras,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)[np.array(column_ends(self.rig.cameras)[:-1]) + FOCAL]))


class _CameraRows(NamedTuple):
    """Errors of one camera in standard deviations, weighted, and their derivatives."""

    index: int
    groups: IntArray
    """Of the observations, (N,)."""
    by_camera: Array
    """(N, 2, n)."""
    by_own: Array
    """By the own unknowns, (N, 2, m)."""
    errors: Array
    """(N, 2, 1)."""
    cost: float
    """Half the sum of robust squares."""


class ReprojectionProblem(ABC):
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
        self.observations, self.n_groups, self.sigmas_px = observations, n_groups, sigmas_px
        self._take_prior(prior)

    def _take_prior(self, prior: Prior) -> None:
        self.prior = prior
        self.columns = [np.flatnonzero(sigmas > 0) for sigmas in prior.sigmas]
        self.ends = np.cumsum([0, *(len(columns) for columns in self.columns)])
        self.precision = np.concatenate([s[c] ** -2.0 for s, c in zip(prior.sigmas, self.columns, strict=True)])
        self.alikeness = np.zeros((len(self.precision), len(self.precision)))
        """Precision of the focal lengths of lenses of one model, which counts like that of observations, (n, n)."""
        for cameras in prior.alike:
            at = [self.ends[i] + int(np.searchsorted(self.columns[i], FOCAL)) for i in cameras]
            self.alikeness[np.ix_(at, at)] = CALIBRATED.focal**-2 * (np.eye(len(at)) - 1 / len(at))

    # --- for subclasses -----------------------------------------------------------------------------------------

    @abstractmethod
    def locate(self, own: Array) -> Located:
        """Return the places of the observed points."""

    @abstractmethod
    def move_own(self, own: Array, step: Array) -> Array:
        """Return the own unknowns after a step, (G, m)."""

    # --- for the solver -----------------------------------------------------------------------------------------

    def linearize(self, rig: Rig, below: float = np.inf) -> ArrowEquations:
        """See `BundleProblem`."""
        out = self.observed(rig)
        moves = zip(self.prior.cameras, rig.cameras, self.columns, strict=True)
        offsets = np.concatenate([camera_difference(before, now)[columns] for before, now, columns in moves])
        precision = np.diag(self.precision) + self.alikeness
        out.gradient[:] += precision @ offsets
        out.hessian[:] += precision
        return out._replace(cost=out.cost + 0.5 * float(offsets @ precision @ offsets))

    def observed(self, rig: Rig) -> ArrowEquations:
        """Return the normal equations of the observations, without the prior."""
        out, cost = ArrowEquations.zeros(int(self.ends[-1]), self.n_groups, self.n_own), 0.0
        for of in self._scaled_rows(rig):
            part = slice(self.ends[of.index], self.ends[of.index + 1])
            flat = of.by_camera.reshape(2 * len(of.groups), part.stop - part.start)
            out.gradient[part] += flat.T @ of.errors.ravel()
            out.hessian[part, part] += flat.T @ flat
            transposed = of.by_own.swapaxes(1, 2)
            _add(out.own_gradients, of.groups, (transposed @ of.errors)[..., 0])
            _add(out.own_hessians, of.groups, transposed @ of.by_own)
            _add(out.cross[:, :, part], of.groups, transposed @ of.by_camera)
            cost += of.cost
        diagonal = np.arange(self.n_own)
        out.own_hessians[:, diagonal, diagonal] += _FLOOR
        return out._replace(cost=cost)

    def _scaled_rows(self, rig: Rig) -> Iterator[_CameraRows]:
        """Yield the rows of each camera. Points that it does not show have rows of 0 and the largest robust square."""
        located = self.locate(rig.own)
        for index, camera in enumerate(rig.cameras):
            at, sigma = self.observations.of_camera(index), self.sigmas_px[index]
            found = project_with_columns(camera, located.points_world[at])
            errors = found.px - self.observations.px[at]
            s = np.sum(errors**2, axis=1) / sigma**2
            shown = np.isfinite(s)
            scale = (np.sqrt(np.where(shown, robust_weights(s), 0.0)) / sigma)[:, None, None]
            J, own = self.by_unknowns(found, at, index), found.by_point
            if not shown.all():
                J, own, errors = (np.where(np.isfinite(rows), rows, 0.0) for rows in (J, own, errors))
            if located.by_own is not None:
                own = own @ located.by_own[at]
            cost = 0.5 * float(robust_squares(np.where(shown, s, np.inf)).sum())
            yield _CameraRows(
                index, self.observations.groups[at], J * scale, own * scale, errors[:, :, None] * scale, cost
            )

    def by_unknowns(self, found: ProjectionDerivatives, at: slice, camera: int) -> Array:
        """Return the derivatives of some projections by the unknowns of their camera, (N, 2, n)."""
        return found.by_camera[:, :, self.columns[camera]]

    def moved(self, rig: Rig, shared: Array, own: Array) -> Rig:
        """See `BundleProblem`."""
        cameras = tuple(moved_camera(c, self.step_of(i, shared)) for i, c in enumerate(rig.cameras))
        return Rig(cameras, self.move_own(rig.own, own))

    def free(self, rig: Rig, equations: ArrowEquations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """See `BundleProblem`."""
        return np.ones(len(self.precision), dtype=bool), np.ones((self.n_groups, self.n_own), dtype=bool)

    def step_of(self, camera: int, shared: Array) -> Array:
        """Return the correction of one camera, (n_columns,), of a step of the shared unknowns, (n,)."""
        out = np.zeros(n_camera_parameters(self.prior.cameras[camera]))
        out[self.columns[camera]] = shared[self.ends[camera] : self.ends[camera + 1]]
        return out

    def variance_inflation(self, rig: Rig) -> float:
        """Return by how much errors of one view agree, at least 1: variance of their means over that of lone errors.

        A board that moves while cameras film it at slightly different times shifts all its corners together. A view
        with such errors holds less information than its number of corners promises; it is a camera's part of a group.
        """
        if self.locate(rig.own).by_own is None:
            return 1.0
        inverse = np.linalg.pinv(self.observed(rig).own_hessians, hermitian=True)
        squares, expected, lone = 0.0, 0.0, 0.0
        for of in self._scaled_rows(rig):
            sums, own_sums = np.zeros((self.n_groups, 2)), np.zeros((self.n_groups, 2, self.n_own))
            _add(sums, of.groups, of.errors[..., 0])
            _add(own_sums, of.groups, of.by_own)
            counts = np.maximum(np.bincount(of.groups, minlength=self.n_groups), 1)
            weights = np.bincount(of.groups, np.sum(of.by_own**2, axis=(1, 2)) > 0, self.n_groups)
            squares += float(np.sum(sums**2 / counts[:, None]))
            lone += float(np.sum(of.errors**2))
            leverages = np.einsum("gij,gjk,gik->g", own_sums, inverse, own_sums) / counts
            expected += float(np.sum(2 * weights / counts - leverages))
        variance = lone / (2 * len(self.observations.px) * self.left)
        return max(1.0, squares / max(expected * variance, 1.0))

    # --- noise --------------------------------------------------------------------------------------------------

    def errors_px(self, rig: Rig) -> Array:
        """Return projection minus observation, (N, 2), px; NaN where a camera does not show the point."""
        points = self.locate(rig.own).points_world
        parts = [self.observations.of_camera(i) for i in range(len(rig.cameras))]
        return np.concatenate(
            [c.project(points[at]) - self.observations.px[at] for c, at in zip(rig.cameras, parts, strict=True)]
        )

    def scaled_sigmas_px(self, rig: Rig, quantile: float) -> Array:
        """Scale all standard deviations by one factor, so that a quantile of the errors is that of Gaussian ones."""
        squares = self._squares_px2(rig) / self.sigmas_px[self.observations.cameras] ** 2
        scale2 = np.quantile(squares, quantile) / (-2 * np.log(1 - quantile)) / self.left
        return np.maximum(self.sigmas_px * np.sqrt(scale2), _MIN_SIGMA_PX)

    def measured_sigmas_px(self, rig: Rig) -> Array:
        """Measure the standard deviation of an observation in each camera by the median error, (n_cameras,), px.

        Free points can be moved onto what a single camera observes, so that its errors alone do not show its noise. The
        ratios of the cameras' noise then stay as they are.
        """
        if self.has_common_noise:
            return self.scaled_sigmas_px(rig, 0.5)
        squares = self._squares_px2(rig)
        parts = [squares[self.observations.of_camera(i)] for i in range(len(rig.cameras))]
        medians = np.array([np.median(part) if len(part) else _MEDIAN_SQUARE for part in parts])
        return np.maximum(np.sqrt(medians / _MEDIAN_SQUARE / self._left_in_cameras(rig)), _MIN_SIGMA_PX)

    def _squares_px2(self, rig: Rig) -> Array:
        """Return squared errors, (N,); a large one where a camera does not show the point."""
        return np.nan_to_num(np.sum(self.errors_px(rig) ** 2, axis=1), nan=_NOT_SHOWN_PX**2)

    @property
    def left(self) -> float:
        """Share of the squared errors that a fit leaves, 0 to 1: one less the unknowns over the observed numbers."""
        spent = self.n_groups * self.n_own + len(self.precision)
        return max(1.0, 2 * len(self.observations.px) - spent) / (2 * len(self.observations.px))

    def _left_in_cameras(self, rig: Rig) -> Array:
        """Return the same share of the errors in each camera, (n_cameras,), by the leverage of its observations."""
        inverse = np.linalg.pinv(self.observed(rig).own_hessians, hermitian=True)
        out = np.ones(len(rig.cameras))
        for of in self._scaled_rows(rig):
            if n := 2 * len(of.groups):
                leverage = np.einsum("nij,njk,nik->", of.by_own, inverse[of.groups], of.by_own)
                out[of.index] = max(1.0, n - leverage - len(self.columns[of.index])) / n
        return out

    def group_costs(self, rig: Rig) -> Array:
        """Return the robust cost of the observations of each group, (G,)."""
        s = self._squares_px2(rig) / self.sigmas_px[self.observations.cameras] ** 2
        return np.asarray(
            0.5 * np.bincount(self.observations.groups, robust_squares(s), self.n_groups), dtype=np.float64
        )

    def with_sigmas(self, sigmas_px: Array) -> Self:
        """Return the problem with other standard deviations."""
        out = copy(self)
        out.sigmas_px = sigmas_px
        return out

    def with_prior(self, prior: Prior) -> Self:
        """Return the problem with other knowledge of the cameras."""
        out = copy(self)
        out._take_prior(prior)
        return out


def fit_rig(problem: ReprojectionProblem, rig: Rig) -> RigFit:
    """Fit cameras and own unknowns, and measure the noise between fits until it settles.

    The standard deviation begins at that of the largest errors and falls to that of the median one, so that no error of
    the start is taken for a gross one (graduated non-convexity, Yang et al. 2020).
    """
    problem = problem.with_sigmas(problem.scaled_sigmas_px(rig, _LARGE))
    for _ in range(_ROUNDS):
        rig = solve_bundle(problem, rig, _STEPS, ROUGH).state
        sigmas = problem.scaled_sigmas_px(rig, 0.5)
        is_settled = bool(np.all(sigmas > (1 - _SETTLED) * problem.sigmas_px))
        problem = problem.with_sigmas(np.maximum(sigmas, problem.sigmas_px / _FALL))
        if is_settled:
            break
    if not problem.has_common_noise:
        for _ in range(_ROUNDS):
            sigmas = problem.measured_sigmas_px(rig)
            is_settled = np.allclose(sigmas, problem.sigmas_px, rtol=_SETTLED)
            problem = problem.with_sigmas(sigmas)
            if is_settled:
                break
            rig = solve_bundle(problem, rig, _STEPS, ROUGH).state
    rig = solve_bundle(problem, rig, tolerance=_FINAL).state
    return _result(problem, rig)


def plain_errors_px(problem: ReprojectionProblem, rig: Rig) -> Array:
    """Fit own unknowns by plain squares, as others report them, to cameras that stay; return the errors, (N, 2), px."""
    plain = problem.with_sigmas(np.full(len(rig.cameras), _PLAIN_PX)).with_prior(Prior.held(rig.cameras))
    return plain.errors_px(solve_bundle(plain, rig, tolerance=_FINAL).state)


def _result(problem: ReprojectionProblem, rig: Rig) -> RigFit:
    errors = problem.errors_px(rig)
    squares = np.sum(errors**2, axis=1) / problem.sigmas_px[problem.observations.cameras] ** 2
    squares = np.nan_to_num(squares, nan=np.inf)
    weights, share = robust_weights(squares), problem.variance_inflation(rig)
    information = _information(squares, weights, problem.left) / share
    data = problem.observed(rig).reduced()[1] + problem.alikeness
    precision = information * data + np.diag(problem.precision)
    if not np.isfinite(precision).all():
        raise np.linalg.LinAlgError("numbers that are not finite")
    covariance = inverse(precision)
    at = np.concatenate([start + c for start, c in zip(column_ends(rig.cameras), problem.columns, strict=False)])
    whole = np.zeros(2 * (column_ends(rig.cameras)[-1],))
    whole[np.ix_(at, at)] = covariance
    return RigFit(rig, problem.sigmas_px, whole, errors, weights, share)


def inverse(matrix: Array) -> Array:
    """Invert a positive semidefinite matrix of unknowns with different units."""
    units = 1 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    return np.asarray(np.linalg.pinv(matrix * np.outer(units, units), hermitian=True) * np.outer(units, units))


def column_ends(cameras: Sequence[Camera]) -> list[int]:
    """Return where the corrections of each camera begin among those of all, and where the last ones end."""
    return [0, *itertools.accumulate(n_camera_parameters(c) for c in cameras)]


def _information(squares: Array, weights: Array, left: float) -> float:
    """Return the true information of robust errors over that of the weighted normal equations (Huber 1981, Sect. 7.6).

    Args:
        squares: squared errors in variances, (N,).
        weights: their robust weights, (N,).
        left: share of the squared errors that the fit has left.
    """
    s = np.where(np.isfinite(squares), squares, 0.0)
    slopes = weights * (1 - 2 * s / (OUTLIER_SIGMAS**2 + s))  # w + s dw/ds
    variance = np.mean(weights**2 * s) / 2 / left
    return float(np.mean(slopes) ** 2 / (variance * np.mean(weights)))


def robust_weights(squares: Array) -> Array:
    """Return the weights of errors by their squares in variances."""
    return np.asarray(1 / (1 + squares / OUTLIER_SIGMAS**2) ** 2)


def robust_squares(squares: Array) -> Array:
    """Return as how much squared errors in variances count; infinite ones as the square of `OUTLIER_SIGMAS`."""
    return np.asarray(OUTLIER_SIGMAS**2 - OUTLIER_SIGMAS**4 / (OUTLIER_SIGMAS**2 + squares))


def _add(target: Array, groups: IntArray, values: Array) -> None:
    """Add values, (N, ...), to the rows of their groups, which are sorted."""
    if len(groups):
        first = np.flatnonzero(np.diff(groups, prepend=-1))
        target[groups[first]] += values if len(first) == len(groups) else np.add.reduceat(values, first, axis=0)
