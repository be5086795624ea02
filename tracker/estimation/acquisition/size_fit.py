"""Fit the sizes of a body and its poses on several frames to contours, all at once, by Gauss-Newton.

The unknowns are the sizes, which all frames share, and the pose of each frame. The residuals are those of the tracker
(`contour_residuals`), with the sizes as further columns of the Jacobian. Priors hold sizes that no frame shows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.dimensions import with_height_of_stature
from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.compute.threads import map_parallel
from tracker.estimation.acquisition.part_motions import (
    motions_by_unknowns,
    points_by_sizes,
    sum_motions,
    to_unknowns,
)
from tracker.estimation.acquisition.size_parameters import SizeArrays, SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations, solve_bundle
from tracker.estimation.fitting.contour_residuals import ContourResiduals, MatchSettings
from tracker.estimation.fitting.gauss_newton import (
    NormalEquations,
    PointTargets,
    PosePrior,
    normal_equations,
    pressed_against_limit,
)
from tracker.estimation.fitting.pins import PinBlock
from tracker.evidence.contours.surfaces import Surfaces
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, IntArray


class SightedPerson(NamedTuple):
    """A person on one frame, with the evidence of the views."""

    frame: int
    views: Sequence[ViewEvidence]
    """Evidence of each view that is the person's."""
    bodies: tuple[PosedBody, ...]
    """All people; the others occlude."""
    person: int
    """Index of the person among them."""
    placed: PointTargets | None = None
    """Positions of points of the body that were placed by hand or are known; None in a frame that was only tracked."""
    seen: PinBlock | None = None
    """Positions of points of the body that a user has marked in the images; None without any."""

    def moved(self, model: BodyModel, pose: Array) -> "SightedPerson":
        """Return the person with another body and pose."""
        own = PosedBody(model, pose, self.bodies[self.person].velocity)
        return self._replace(bodies=(*self.bodies[: self.person], own, *self.bodies[self.person + 1 :]))

    @property
    def pose(self) -> Array:
        """The person's pose, (n_values,)."""
        return self.bodies[self.person].values


@dataclass(frozen=True)
class Round:
    """A round of the fit, from coarse to fine."""

    kinds: tuple[str, ...]
    """Kinds of parameters that are free, see `SizePriors`."""
    reach: float
    """Outlier distance, in that of the views."""
    iterations: int = 12
    """Largest number of steps."""


ROUNDS = (
    Round(("height", "build"), 1.5, 8),
    Round(("height", "build", "length", "girth", "end", "free_end", "side", "joint"), 1.0),
    Round(("height", "build", "length", "girth", "end", "free_end", "side", "joint", "taper", "exponent"), 0.6, 20),
)
"""First the body as a whole, then its parts, then their shapes."""


@dataclass(frozen=True)
class SizeFitSettings:
    """Settings of the fit."""

    match: MatchSettings = field(default_factory=MatchSettings)
    """Weights of the contour residuals."""
    rounds: tuple[Round, ...] = ROUNDS
    trust_rad: float = 0.3
    """Standard deviation of the initial angles, rad."""
    trust_m: float = 0.1
    """Standard deviation of the initial position, metres."""
    tolerance: float = 1e-4
    """Smallest relative decrease of the cost for another iteration."""
    frame_correlation: float = 0.3
    """Correlation between frames of the mean error of a part's contours: clothes and wrong shapes stay the same. It is
    0.22 to 0.65 on seven simulated people, 0.29 in the median. It widens the covariance of the sizes."""


class SizeStart(NamedTuple):
    """The start of a fit that does not begin at the body before."""

    sizes: Array
    """Parameters, (n_sizes,), see `SizeParameters`."""
    covariance: Array
    """Of the sizes, (n_sizes, n_sizes)."""
    poses: Mapping[int, Array]
    """By frame, (n_values,)."""


class SizeFit(NamedTuple):
    """Sizes and poses that fit the frames."""

    sizes: Array
    """Parameters, (n_sizes,), see `SizeParameters`."""
    body: BodyModel
    """The body with these sizes; its height is its stature."""
    poses: tuple[Array, ...]
    """Pose of each frame, (n_values,)."""
    cost: float
    """Half the weighted sum of squares, of evidence and priors."""
    covariance: Array
    """Of the sizes, (n_sizes, n_sizes), whatever the poses are."""
    n_evaluations: int = 0
    """Number of evaluations of the residuals of all frames."""


class _State(NamedTuple):
    """Unknowns of the fit."""

    sizes: Array
    """Parameters, (n_sizes,)."""
    poses: list[Array]
    """Of each frame, (n_values,)."""


def fit_sizes_to_contours(
    parameters: SizeParameters,
    frames: Sequence[SightedPerson],
    settings: SizeFitSettings,
    start: SizeStart | None = None,
    report: Callable[[float], None] = lambda share: None,
) -> SizeFit:
    """Fit sizes and poses to the contours of several frames.

    Args:
        parameters: the sizes; their prior has the mean 0.
        frames: the frames, with the initial poses.
        settings: of the fit.
        start: initial sizes and poses; by default those of the frames. Without rounds they are returned as they are.
        report: is given the share of the work that is done, 0 to 1. An exception that it raises ends the fit.
    """
    n = len(parameters.names)
    if start is None:
        start = SizeStart(np.zeros(n), np.diag(parameters.sigmas**2), {})
    state, covariance = _State(start.sizes, [start.poses.get(f.frame, f.pose) for f in frames]), start.covariance
    cost, n_evaluations = np.nan, 0
    planned, done = sum(step.iterations for step in settings.rounds), 0
    for step in settings.rounds:
        body = parameters.body(state.sizes)
        people = [f.moved(body, p) for f, p in zip(frames, state.poses, strict=True)]
        found = solve_bundle(
            _Problem(parameters, people, settings, step), state, step.iterations, settings.tolerance,
            partial(_report_iteration, report, done, planned),
        )  # fmt: skip
        done += step.iterations
        state, cost = found.state, found.cost
        n_evaluations += found.evaluations
        if step is settings.rounds[-1]:
            covariance = _covariance(found.equations, parameters.sigmas, settings.frame_correlation)
    sizes, poses = state
    body = with_height_of_stature(parameters.body(sizes), parameters.base)
    return SizeFit(sizes, body, tuple(poses), cost, covariance, n_evaluations)


def _report_iteration(report: Callable[[float], None], done: int, planned: int, iteration: int) -> None:
    report((done + iteration) / planned)


def _covariance(equations: ArrowEquations, sigmas: Array, correlation: float) -> Array:
    """Return the covariance of the sizes, whatever the poses are, (n_sizes, n_sizes).

    Frames whose errors are alike count as n / (1 + (n - 1) correlation) independent ones, the design effect of samples
    in clusters (L. Kish, Survey Sampling, 1965). Along a contour errors are correlated over 7 px on simulated people,
    so that `MatchSettings.information_per_px` counts each contour with care already.

    Args:
        equations: of the fit, by the sizes and the pose of each frame.
        sigmas: standard deviations of the sizes in the prior, which the equations contain, (n_sizes,).
        correlation: of the errors of two frames.
    """
    precision = np.diag(1 / sigmas**2)
    of_frames = equations.reduced()[1] - precision
    design_effect = 1 + (len(equations.cross) - 1) * correlation
    return np.asarray(np.linalg.inv(precision + of_frames / design_effect), dtype=np.float64)


class _Resized(NamedTuple):
    """A body at the sizes of a step."""

    body: BodyModel
    by_sizes: SizeArrays
    """Derivatives of its sizes."""
    surfaces: Surfaces | None
    """Its shapes, and those of the other people on a frame; None without views."""


class _Problem:
    """The least-squares problem of one round, see `BundleProblem`: the poses are own unknowns of the frames."""

    def __init__(
        self, parameters: SizeParameters, frames: Sequence[SightedPerson], settings: SizeFitSettings, step: Round
    ) -> None:
        """Prepare the evidence around the poses of the frames."""
        self._parameters, self._frames = parameters, frames
        self._free = parameters.of_kinds(*step.kinds)
        self._residuals = map_parallel(lambda f: _residuals(f, settings, step), frames)
        self._others = [tuple(b.model for k, b in enumerate(f.bodies) if k != f.person) for f in frames]
        self._with_shapes = bool({"taper", "exponent"} & set(step.kinds))
        model = parameters.base
        sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)
        usual = PosePrior.of_spreads(model)
        self._priors = [[PosePrior(f.pose, 1 / sigma), usual] for f in frames]

    def moved(self, state: _State, shared: Array, own: Array) -> _State:
        """See `BundleProblem`."""
        model = self._parameters.base
        moved = [model.clip(model.retract(p, s)) for p, s in zip(state.poses, own, strict=True)]
        return _State(state.sizes + shared, moved)

    def free(self, state: _State, equations: ArrowEquations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return the free sizes, and the degrees of freedom that no limit holds."""
        model = self._parameters.base
        own = [
            ~pressed_against_limit(model, pose, g) for pose, g in zip(state.poses, equations.own_gradients, strict=True)
        ]
        return self._free, np.array(own).reshape(equations.own_gradients.shape)

    def linearize(self, state: _State, below: float = np.inf) -> ArrowEquations:
        """See `BundleProblem`."""
        sizes, poses = state
        body, by_sizes = self._parameters.body(sizes), self._parameters.derivatives(sizes)
        n = len(sizes)
        # Frames with the same people share the arrays of their shapes.
        representatives = {o: r[0] for o, r in zip(self._others, self._residuals, strict=True) if r}
        surfaces = {others: residuals.resized(body) for others, residuals in representatives.items()}
        found = map_parallel(
            lambda i: self._linearize_frame(i, _Resized(body, by_sizes, surfaces.get(self._others[i])), poses[i]),
            range(len(poses)),
        )
        out, prior = ArrowEquations.zeros(n, len(poses), body.n_dofs), sizes / self._parameters.sigmas**2
        out.gradient[:] = prior
        out.hessian[:] = np.diag(1 / self._parameters.sigmas**2)
        for i, of_frame in enumerate(found):
            out.add(i, of_frame)
        return out._replace(cost=0.5 * float(prior @ sizes) + sum(f.cost for f in found))

    def _linearize_frame(self, i: int, resized: _Resized, pose: Array) -> NormalEquations:
        """Return the normal equations of a frame by the sizes, then by its pose."""
        body, by_sizes, _ = resized
        kinematics, n = body.kinematics(pose), by_sizes.joints.shape[-1]
        cost, gradient, hessian = 0.0, np.zeros(n + body.n_dofs), np.zeros((n + body.n_dofs, n + body.n_dofs))
        for time in sorted({v.ahead_frames for v in self._frames[i].views}):
            own = self._linearize_views(i, resized, pose, time)
            cost, gradient, hessian = cost + own.cost, gradient + own.gradient, hessian + own.hessian
        placed = self._frames[i].placed
        if placed is not None:
            own = _linearize_placed(placed, body, kinematics, by_sizes)
            cost, gradient, hessian = cost + own.cost, gradient + own.gradient, hessian + own.hessian
        seen = self._frames[i].seen
        if seen is not None:
            r, by_points = seen.residuals(body, kinematics)
            rows = by_points @ _points_by_unknowns(seen.points, body, kinematics, by_sizes)
            own = normal_equations(r.ravel(), rows.reshape(-1, rows.shape[2]))
            cost, gradient, hessian = cost + own.cost, gradient + own.gradient, hessian + own.hessian
        for block in self._priors[i]:
            prior = block.linearize(body, pose, kinematics)
            cost += prior.cost
            gradient[n:] += prior.gradient
            hessian[n:, n:] += prior.hessian
        return NormalEquations(cost, gradient, hessian)

    def _linearize_views(self, i: int, resized: _Resized, pose: Array, ahead_frames: float) -> NormalEquations:
        """Return the same of the views whose pictures were taken some frames later than the frame.

        The velocity stays, so that the derivative of the later pose by the pose is the identity (`ClockedResiduals`).
        """
        (body, by_sizes, surfaces), frame = resized, self._frames[i]
        then = PosedBody(body, pose, frame.bodies[frame.person].velocity).ahead(ahead_frames)
        cost, pieces = 0.0, []
        for residuals, view in zip(self._residuals[i], frame.views, strict=True):
            if view.ahead_frames == ahead_frames:
                assert surfaces is not None
                own_cost, sums = residuals.piece_sums(then.kinematics, surfaces)
                cost += own_cost
                pieces.append((view.camera, sums))
        sums_of_motions = sum_motions(pieces, body, then.kinematics, self._with_shapes)
        by_unknowns = motions_by_unknowns(body, then.kinematics, by_sizes)
        return NormalEquations(cost, *to_unknowns(by_unknowns, *sums_of_motions))


def _linearize_placed(
    placed: PointTargets, body: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays
) -> NormalEquations:
    """Return the normal equations of placed points by the sizes, then by the pose."""
    rows = _points_by_unknowns(placed.points, body, kinematics, by_sizes) * placed.weights[:, None, None]
    r = (body.points_at(kinematics, placed.points) - placed.targets_world) * placed.weights[:, None]
    return normal_equations(r.ravel(), rows.reshape(-1, rows.shape[2]))


def _points_by_unknowns(points: IntArray, body: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate some points, given by index (N,), by the sizes and then the pose, (N, 3, n_unknowns), metres."""
    by_pose = body.point_jacobian(kinematics, body.point_parts[points], body.points_at(kinematics, points))
    return np.concatenate([points_by_sizes(body, kinematics, by_sizes)[points], by_pose], axis=2)


def _residuals(person: SightedPerson, settings: SizeFitSettings, step: Round) -> list[ContourResiduals]:
    """Return the residuals of each view by itself."""
    return [
        ContourResiduals(
            [v], ahead(person.bodies, v.ahead_frames), person.person, settings.match, step.reach * v.theta_px / v.scale
        )
        for v in person.views
    ]
