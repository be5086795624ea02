"""Fit poses, sizes of bodies and corrections of cameras to the contours of several frames at once.

View c of frame k sees the pose q_k + p_k(d_c + r_c T_k), with p_k the way of the pose around the frame. Corrections
and sizes are shared unknowns, the pose of each person on each frame is their own (`bundle`). Residuals are those of the
tracker (`contour_residuals`), and other blocks by the points or the pose of a person.
"""

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.compute.threads import map_parallel
from tracker.estimation.acquisition.part_derivatives import part_jacobian, points_by_sizes
from tracker.estimation.acquisition.piece_sums import GroupSums, SeenPieces, sums_of_views
from tracker.estimation.acquisition.size_parameters import SizeArrays, SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations
from tracker.estimation.fitting.contour_residuals import ContourResiduals, MatchSettings
from tracker.estimation.fitting.gauss_newton import (
    NormalEquations,
    PosePrior,
    ResidualBlock,
    normal_equations,
    pressed_against_limit,
)
from tracker.evidence.contours.surfaces import Surfaces
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.camera_correction import N_CORRECTIONS, corrected, later_s, with_step

SIZE_KINDS = ("height", "build", "length", "girth", "end", "free_end", "side", "joint")
"""Kinds of sizes that are found together with the cameras, see `SizePriors`: a body of other sizes looks like a
camera at another depth."""
SHAPE_KINDS = ("taper", "exponent")
"""Kinds of sizes by which points move on their part in other ways than with its half-axes."""


class PointBlock(Protocol):
    """Evidence for the places of points of a body."""

    @property
    def points(self) -> IntArray:
        """Indices into `BodyModel.point_names`, (N,)."""
        ...

    def residuals(self, model: BodyModel, kinematics: Kinematics) -> tuple[Array, Array]:
        """Return weighted residuals, (N, m), and their derivatives by the points, (N, m, 3), per metre."""
        ...


class SeenPerson(NamedTuple):
    """A person on one frame, as the views show them."""

    person: int
    """Index of the person, whose sizes all frames share."""
    views: Sequence[ViewEvidence]
    """Evidence of each view that is the person's, in the order of the cameras."""
    bodies: tuple[PosedBody, ...]
    """All people; the others occlude."""
    paths: tuple[PosePath, ...]
    """Way of each person's pose around the frame."""
    time_s: float
    """Time of the frame, seconds, since that to which drifts are related."""
    ahead_s: Sequence[float]
    """Time by which the picture of each view was taken later than the frame, by the present clocks, seconds."""
    points: tuple[PointBlock, ...] = ()
    """Evidence by points of the body."""
    prior: ResidualBlock | None = None
    """Of the pose, besides the usual spreads of joints."""

    @property
    def path(self) -> PosePath:
        """Way of the person's pose."""
        return self.paths[self.person]


class RigState(NamedTuple):
    """Unknowns of a rig and of the people in it."""

    corrections: Array
    """Of each camera, (V, N_CORRECTIONS)."""
    sizes: tuple[Array, ...]
    """Parameters of each person's body, (n_sizes,)."""
    poses: tuple[Array, ...]
    """Of each person on each frame, (n_values,)."""


class SeenView(NamedTuple):
    """Evidence of one view for a person on a frame."""

    camera: int
    evidence: ViewEvidence
    residuals: ContourResiduals


class ContourBundle:
    """Least squares over people on frames and the cameras that show them, see `BundleProblem`. The shared unknowns are
    the corrections of one camera after the other, then the sizes of one person after the other."""

    def __init__(
        self, seen: Sequence[SeenPerson], parameters: Sequence[SizeParameters], corrections: Array,
        sigmas: Array | None = None, kinds: Sequence[str] = SIZE_KINDS, settings: MatchSettings | None = None,
        reach: float = 1.0,
    ) -> None:  # fmt: skip
        """Prepare the evidence around the present poses and cameras.

        Args:
            seen: people on frames.
            parameters: sizes of each person's body; their priors have the mean 0.
            corrections: present ones of each camera, (V, N_CORRECTIONS); contours are predicted by them.
            sigmas: standard deviations of the corrections in their prior, (N_CORRECTIONS,); None for known cameras.
            kinds: of the sizes that are unknown.
            settings: weights of the contour residuals.
            reach: outlier distance, in that of the views.
        """
        self._seen, self._parameters = seen, parameters
        self._sigmas = np.zeros((0, N_CORRECTIONS)) if sigmas is None else np.tile(sigmas, (len(corrections), 1))
        self._views = map_parallel(lambda s: views_of(s, corrections, settings, reach), seen)
        self._priors = [PosePrior.of_spreads(p.base) for p in parameters]
        self._fitted = [np.flatnonzero(p.of_kinds(*kinds)) for p in parameters]
        """Indices of each person's sizes that are unknown."""
        ends = np.cumsum([self._sigmas.size, *map(len, self._fitted)]).tolist()
        self._ranges = tuple(itertools.starmap(slice, itertools.pairwise(ends)))
        """Their places among the shared unknowns."""
        self._free = np.ones(ends[-1], np.bool_)
        self._free[: self._sigmas.size] = False
        self._n_own = max(p.base.n_dofs for p in parameters)
        """Most degrees of freedom of a person; those that others lack are held."""
        self._groups = [(s.person, tuple(b.model for b in s.bodies)) for s in seen]
        """Frames of a person with the same people share the arrays of their shapes."""
        self._with_shapes = bool(set(SHAPE_KINDS) & set(kinds))

    @property
    def n_shared(self) -> int:
        """Number of shared unknowns."""
        return len(self._free)

    def with_free(self, columns: IntArray) -> "ContourBundle":
        """Return the same problem in which some corrections may change, by their places among those of all cameras."""
        out = copy(self)
        out._free = self._free.copy()
        out._free[: self._sigmas.size] = np.isin(np.arange(self._sigmas.size), columns)
        return out

    def with_free_sizes(self, *kinds: str) -> "ContourBundle":
        """Return the same problem in which sizes of some kinds may change."""
        out = copy(self)
        fitted = zip(self._parameters, self._fitted, strict=True)
        of_kinds = [p.of_kinds(*kinds)[at] for p, at in fitted]
        out._free = np.concatenate([self._free[: self._sigmas.size], *of_kinds])
        out._with_shapes = self._with_shapes and bool(set(SHAPE_KINDS) & set(kinds))
        return out

    def moved(self, state: RigState, shared: Array, own: Array) -> RigState:
        """See `BundleProblem`."""
        corrections, poses, sizes = state.corrections, [], [s.copy() for s in state.sizes]
        if self._sigmas.size:
            steps = shared[: self._sigmas.size].reshape(self._sigmas.shape)
            corrections = np.array([with_step(c, s) for c, s in zip(corrections, steps, strict=True)])
        for of_person, fitted, at in zip(sizes, self._fitted, self._ranges, strict=True):
            of_person[fitted] += shared[at]
        for seen, pose, step in zip(self._seen, state.poses, own, strict=True):
            model = self._model(seen)
            poses.append(model.move(pose, step[: model.n_dofs]))
        return RigState(corrections, tuple(sizes), tuple(poses))

    def free(self, state: RigState, equations: ArrowEquations) -> tuple[Mask, Mask]:
        """See `BundleProblem`."""
        own = np.zeros(equations.own_gradients.shape, np.bool_)
        for seen, pose, gradient, out in zip(self._seen, state.poses, equations.own_gradients, own, strict=True):
            model = self._model(seen)
            out[: model.n_dofs] = ~pressed_against_limit(model, pose, gradient[: model.n_dofs])
        return self._free, own

    def linearize(self, state: RigState, below: float = np.inf) -> ArrowEquations:
        """See `BundleProblem`."""
        resized = {key: self._resized(key, state.sizes[key[0]]) for key in dict.fromkeys(self._groups)}
        bodies = [resized[key] for key in self._groups]
        residuals = map_parallel(lambda g: self._residuals(g, state, bodies[g]), range(len(bodies)))
        priors = self._shared_priors(state)
        cost = sum(r.cost for r in residuals)
        cost += sum(0.5 * float(residuals @ residuals) for _, residuals, _ in priors)
        out = ArrowEquations.zeros(self.n_shared, len(self._seen), self._n_own)._replace(cost=cost)
        if cost >= below:
            return out
        found = map_parallel(lambda g: self._summed(g, state, bodies[g], residuals[g]), range(len(bodies)))
        for group, (seen, own) in enumerate(zip(self._seen, found, strict=True)):
            self._enter(out, group, seen.person, own)
        for at, residuals, rows in priors:
            out.gradient[at] += rows.T @ residuals
            out.hessian[at, at] += rows.T @ rows
        return out

    def _shared_priors(self, state: RigState) -> list[tuple[slice, Array, Array]]:
        """Return the range of each prior among the shared parameters, its residuals, and their derivatives."""
        corrections, sigmas = state.corrections[: len(self._sigmas)].ravel(), self._sigmas.ravel()
        rows = [(slice(0, sigmas.size), corrections / sigmas, np.diag(1 / sigmas))]
        for at, sizes, parameters, fitted in zip(
            self._ranges, state.sizes, self._parameters, self._fitted, strict=True
        ):
            prior = parameters.prior[:, fitted]
            rows.append((at, prior @ sizes[fitted], prior))
        return rows

    def _enter(self, out: ArrowEquations, group: int, person: int, found: NormalEquations) -> None:
        """Enter the equations of a group, by corrections, sizes of its person, and pose, into those of all."""
        cameras, sizes = slice(0, self._sigmas.size), self._ranges[person]
        n = cameras.stop + sizes.stop - sizes.start
        m, blocks = len(found.gradient) - n, ((cameras, cameras), (sizes, slice(cameras.stop, n)))
        for to, of in blocks:
            out.gradient[to] += found.gradient[of]
            out.cross[group, :m, to] = found.hessian[n:, of]
            for other_to, other_of in blocks:
                out.hessian[to, other_to] += found.hessian[of, other_of]
        out.own_gradients[group, :m] = found.gradient[n:]
        out.own_hessians[group, :m, :m] = found.hessian[n:, n:]
        rest = np.arange(m, self._n_own)
        out.own_hessians[group, rest, rest] = 1.0

    def _residuals(self, group: int, state: RigState, resized: "_Resized") -> "_GroupResiduals":
        """Return the residuals of a person on a frame."""
        body, seen, pose = resized.body, self._seen[group], state.poses[group]
        kinematics, views = body.kinematics(pose), []
        priors = [p.linearize(body, pose, kinematics) for p in (self._priors[seen.person], seen.prior) if p is not None]
        cost, moments = sum(p.cost for p in priors), dict[float, Kinematics]()
        for camera, evidence, residuals in self._views[group]:
            delay_s = float(seen.ahead_s[camera] + later_s(state.corrections[camera], seen.time_s))
            if delay_s not in moments:
                then = body.kinematics(body.retract(pose, seen.path.step(delay_s))) if delay_s else kinematics
                moments[delay_s] = then
            shown_by = corrected(evidence.camera, state.corrections[camera])
            other = shown_by if self._sigmas.size else None
            own_cost, pieces = residuals.piece_sums(moments[delay_s], resized.surfaces, other)
            cost += own_cost
            views.append(SeenPieces(camera, shown_by, delay_s, pieces))
        points = [_by_points(block, body, kinematics, resized.by_sizes) for block in seen.points]
        return _GroupResiduals(cost + sum(p.cost for p in points), priors, points, moments, views)

    def _summed(self, group: int, state: RigState, resized: "_Resized", found: "_GroupResiduals") -> NormalEquations:
        """Return the normal equations of a person on a frame: by all corrections, the sizes, and the pose."""
        body, by_sizes, _ = resized
        seen, n_sizes, n_cameras = self._seen[group], by_sizes.joints.shape[-1], self._sigmas.size
        sums = GroupSums.zeros(n_cameras, n_sizes + body.n_dofs)
        for delay_s, kinematics in found.moments.items():
            views = [v for v in found.views if v.delay_s == delay_s]
            J = part_jacobian(body, kinematics, by_sizes, self._with_shapes)
            of_views = sums_of_views([(v.shown_by, v.pieces) for v in views], body, kinematics, J.shape[1])
            moving, by_parts = J[:, :, n_sizes:] @ seen.path.velocity(delay_s), np.zeros((n_cameras, J[:, :, 0].size))
            for view, of_view in zip(views, of_views, strict=True) if n_cameras else ():
                sums.add_camera(view, of_view, state.corrections[view.camera], moving, seen.time_s, by_parts)
            sums.add_body(of_views, J, by_parts)
        out = sums.equations(found.cost)
        for first, more in [(n_cameras, p) for p in found.points] + [(n_cameras + n_sizes, p) for p in found.priors]:
            out.gradient[first:] += more.gradient
            out.hessian[first:, first:] += more.hessian
        return out

    def _resized(self, group: tuple[int, tuple[BodyModel, ...]], sizes: Array) -> "_Resized":
        """Return a person's body at other sizes, (n_sizes,), among the people of some frames."""
        parameters, fitted = self._parameters[group[0]], self._fitted[group[0]]
        body, by_sizes = parameters.body(sizes), parameters.derivatives(sizes)
        views = (v for own, views in zip(self._groups, self._views, strict=True) if own == group for v in views)
        first = next(views, None)
        surfaces = None if first is None else first.residuals.resized(body)
        return _Resized(body, SizeArrays(*(by[..., fitted] for by in by_sizes)), surfaces)

    def _model(self, seen: SeenPerson) -> BodyModel:
        return self._parameters[seen.person].base


class _Resized(NamedTuple):
    """A body at the sizes of a step."""

    body: BodyModel
    by_sizes: SizeArrays
    """Derivatives by the unknown sizes."""
    surfaces: Surfaces | None
    """Its shapes, and those of other people; None where no view shows it."""


class _GroupResiduals(NamedTuple):
    """Residuals of a person on a frame."""

    cost: float
    """Of all."""
    priors: list[NormalEquations]
    """Of the pose."""
    points: list[NormalEquations]
    """Of points, by the sizes and the pose."""
    moments: dict[float, Kinematics]
    """The person at each time at which a picture was taken, by how much later than the frame it is, seconds."""
    views: list[SeenPieces]


def _by_points(block: PointBlock, body: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> NormalEquations:
    """Return the normal equations of points by the sizes, then by the pose."""
    _, by_pose = body.points_with_jacobian(kinematics, block.points)
    by_unknowns = np.concatenate([points_by_sizes(body, kinematics, by_sizes)[block.points], by_pose], axis=2)
    r, by_points = block.residuals(body, kinematics)
    rows = by_points @ by_unknowns
    return normal_equations(r.ravel(), rows.reshape(-1, rows.shape[2]))


def views_of(
    seen: SeenPerson, corrections: Array, settings: MatchSettings | None = None, reach: float = 1.0
) -> list[SeenView]:
    """Return the views that show anything of a person, with the residuals of each; see `ContourBundle`."""
    out = []
    for i, (view, correction) in enumerate(zip(seen.views, corrections, strict=True)):
        if not len(view.points_px):
            continue
        bodies = later(seen.bodies, seen.paths, seen.ahead_s[i] + later_s(correction, seen.time_s))
        evidence = replace(view, camera=corrected(view.camera, correction))
        theta_px = reach * view.theta_px / view.scale
        out.append(SeenView(i, view, ContourResiduals([evidence], bodies, seen.person, settings, theta_px)))
    return out


def later(bodies: Sequence[PosedBody], paths: Sequence[PosePath], delay_s: float) -> list[PosedBody]:
    """Return people as they are some time later."""
    return [PosedBody(b.model, b.model.retract(b.values, p.step(delay_s))) for b, p in zip(bodies, paths, strict=True)]
