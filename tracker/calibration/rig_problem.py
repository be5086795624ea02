"""Fit corrections of cameras, sizes of bodies and poses to the contours of several frames at once.

View c of frame k sees the pose q_k + p_k(d_c + r_c T_k), with p_k the way of the tracked pose. Corrections
and sizes are shared unknowns, the pose of each person on each frame is their own (`bundle`). Residuals are those of the
tracker (`contour_residuals`).
"""

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.acquisition.part_motions import motions_by_unknowns
from tracker.acquisition.size_parameters import SizeArrays, SizeParameters
from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody
from tracker.calibration.camera_correction import N_CORRECTIONS, ROTATION, TIME, corrected, later_s, with_step
from tracker.calibration.rig_kernels import N_CAMERA, N_PART, sum_pieces
from tracker.compute.threads import map_parallel
from tracker.contours.surfaces import Surfaces
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.bundle import ArrowEquations
from tracker.fitting.contour_residuals import ContourResiduals, PieceSums
from tracker.fitting.gauss_newton import NormalEquations, PosePrior, pressed_against_limit
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp
from tracker.motion.pose_path import PosePath

SIZE_KINDS = ("height", "build", "length", "girth", "end", "free_end", "side", "joint")
"""Kinds of sizes that are found together with the cameras, see `SizePriors`: a body of other sizes looks like a
camera at another depth."""


class SeenPerson(NamedTuple):
    """A person on one frame, as the views show them."""

    frame: int
    person: int
    """Index of the person, whose sizes all frames share."""
    views: Sequence[ViewEvidence]
    """Evidence of each view that is the person's, in the order of the cameras."""
    bodies: tuple[PosedBody, ...]
    """All people; the others occlude."""
    path: PosePath
    """Way of the person's pose around the frame."""
    time_s: float
    """Time of the frame, seconds, since that to which drifts are related."""
    ahead_s: Sequence[float]
    """Time by which the picture of each view was taken later than the frame, by the present clocks, seconds."""

    @property
    def body(self) -> PosedBody:
        """The person's body."""
        return self.bodies[self.person]

    def moved(self, pose: Array) -> "SeenPerson":
        """Return the person in another pose."""
        bodies = tuple(PosedBody(b.model, pose) if i == self.person else b for i, b in enumerate(self.bodies))
        return self._replace(bodies=bodies)


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


class RigProblem:
    """The least-squares problem of a rig, see `BundleProblem`. The shared unknowns are the corrections of one camera
    after the other, then the sizes of one person after the other."""

    def __init__(
        self, seen: Sequence[SeenPerson], parameters: Sequence[SizeParameters], sigmas: Array,
        corrections: Array,
    ) -> None:  # fmt: skip
        """Prepare the evidence around the present poses and cameras.

        Args:
            seen: people on frames.
            parameters: sizes of each person's body; their priors have the mean 0.
            sigmas: standard deviations of the corrections in their prior, (N_CORRECTIONS,).
            corrections: present ones of each camera, (V, N_CORRECTIONS); contours are predicted by them.
        """
        self._seen, self._parameters = seen, parameters
        self._sigmas = np.tile(sigmas, (len(corrections), 1))
        self._free_corrections, self._has_free_sizes = np.zeros(self._sigmas.shape, np.bool_), True
        self._views = map_parallel(lambda s: views_of(s, corrections), seen)
        self._priors = [PosePrior.of_spreads(p.base) for p in parameters]

    def with_free(self, corrections: NDArray[np.bool_], sizes: bool = True) -> "RigProblem":
        """Return the same problem in which some corrections may change, (V, N_CORRECTIONS), and the sizes or not."""
        out = copy(self)
        out._free_corrections, out._has_free_sizes = corrections, sizes
        return out

    @cached_property
    def _ranges(self) -> tuple[slice, ...]:
        """Places of each person's sizes among the shared unknowns."""
        ends = np.cumsum([self._sigmas.size, *(len(p.names) for p in self._parameters)])
        return tuple(slice(int(a), int(b)) for a, b in itertools.pairwise(ends))

    @cached_property
    def n_shared(self) -> int:
        """Number of shared unknowns."""
        return self._ranges[-1].stop

    @cached_property
    def _n_own(self) -> int:
        """Most degrees of freedom of a person; those that others lack are held."""
        return max(p.base.n_dofs for p in self._parameters)

    def moved(self, state: RigState, shared: Array, own: Array) -> RigState:
        """See `BundleProblem`."""
        steps = shared[: self._sigmas.size].reshape(self._sigmas.shape)
        poses = []
        for seen, pose, step in zip(self._seen, state.poses, own, strict=True):
            model = self._model(seen)
            poses.append(model.clip(model.retract(pose, step[: model.n_dofs])))
        return RigState(
            np.array([with_step(c, s) for c, s in zip(state.corrections, steps, strict=True)]),
            tuple(s + shared[at] for s, at in zip(state.sizes, self._ranges, strict=True)),
            tuple(poses),
        )

    def free(self, state: RigState, equations: ArrowEquations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """See `BundleProblem`."""
        sizes = [p.of_kinds(*SIZE_KINDS) & self._has_free_sizes for p in self._parameters]
        own = np.zeros(equations.own_gradients.shape, np.bool_)
        for seen, pose, gradient, out in zip(self._seen, state.poses, equations.own_gradients, own, strict=True):
            model = self._model(seen)
            out[: model.n_dofs] = ~pressed_against_limit(model, pose, gradient[: model.n_dofs])
        return np.concatenate([self._free_corrections.ravel(), *sizes]), own

    def linearize(self, state: RigState) -> ArrowEquations:
        """See `BundleProblem`."""
        bodies = [p.body(s) for p, s in zip(self._parameters, state.sizes, strict=True)]
        by_sizes = [p.derivatives(s) for p, s in zip(self._parameters, state.sizes, strict=True)]
        surfaces = [self._surfaces(i, body) for i, body in enumerate(bodies)]

        def of_group(group: int) -> NormalEquations:
            person = self._seen[group].person
            return self._linearize_group(group, state, _Resized(bodies[person], by_sizes[person], surfaces[person]))

        found = map_parallel(of_group, range(len(self._seen)))
        out = ArrowEquations.zeros(self.n_shared, len(self._seen), self._n_own)
        cost = sum(f.cost for f in found)
        for group, (seen, own) in enumerate(zip(self._seen, found, strict=True)):
            self._enter(out, group, seen.person, own)
        for at, deviations, sigmas in self._shared_priors(state):
            cost += 0.5 * float(np.sum((deviations / sigmas) ** 2))
            out.gradient[at] += deviations / sigmas**2
            out.hessian[at, at] += np.diag(1 / sigmas**2)
        return out._replace(cost=cost)

    def _shared_priors(self, state: RigState) -> list[tuple[slice, Array, Array]]:
        rows = [(slice(0, self._sigmas.size), state.corrections.ravel(), self._sigmas.ravel())]
        for at, sizes, parameters in zip(self._ranges, state.sizes, self._parameters, strict=True):
            rows.append((at, sizes, parameters.sigmas))
        return rows

    def _enter(self, out: ArrowEquations, group: int, person: int, found: NormalEquations) -> None:
        """Enter the equations of a group, by corrections, sizes of its person, and pose, into those of all."""
        n_cameras, own_sizes = self._sigmas.size, self._ranges[person]
        at = np.concatenate([np.arange(n_cameras), np.arange(own_sizes.start, own_sizes.stop)])
        n, m = len(at), len(found.gradient) - len(at)
        out.gradient[at] += found.gradient[:n]
        out.hessian[np.ix_(at, at)] += found.hessian[:n, :n]
        out.own_gradients[group, :m] = found.gradient[n:]
        out.own_hessians[group, :m, :m] = found.hessian[n:, n:]
        out.cross[group, :m, at] = found.hessian[:n, n:]
        rest = np.arange(m, self._n_own)
        out.own_hessians[group, rest, rest] = 1.0

    def _linearize_group(self, group: int, state: RigState, resized: "_Resized") -> NormalEquations:
        """Return the normal equations of a person on a frame: by all corrections, the sizes, and the pose."""
        body, by_sizes, surfaces = resized
        seen, pose = self._seen[group], state.poses[group]
        prior = self._priors[seen.person].linearize(body, pose, body.kinematics(pose))
        n_sizes, n_cameras = by_sizes.joints.shape[-1], self._sigmas.size
        sums = GroupSums.zeros(n_cameras, n_sizes + body.n_dofs)
        cost = prior.cost
        for delay, views in itertools.groupby(
            self._views[group],
            lambda v: float(seen.ahead_s[v.camera] + later_s(state.corrections[v.camera], seen.time_s)),
        ):
            assert surfaces is not None
            then = body.retract(pose, seen.path.step(delay)) if delay else pose
            kinematics, of_body = body.kinematics(then), np.zeros((len(body.parts), N_PART, N_PART))
            J = motions_by_unknowns(body, kinematics, by_sizes)[:, :N_PART]
            moving, pulls = J[:, :, n_sizes:] @ seen.path.velocity(delay), np.zeros(J.shape[:2])
            for view in views:
                correction = state.corrections[view.camera]
                camera = corrected(view.evidence.camera, correction)
                own_cost, pieces = view.residuals.with_surfaces(body, surfaces).with_camera(camera).piece_sums(then)
                cost += own_cost
                b, M = sums_of_pieces(pieces, body, kinematics, camera, correction)
                pulls += b[:, :N_PART]
                of_body += M[:, :N_PART, :N_PART]
                sums.add_camera(view.camera, b, M, J, moving, seen.time_s)
            sums.add_body(pulls, of_body, J)
        out = sums.equations(cost)
        out.gradient[n_cameras + n_sizes :] += prior.gradient
        out.hessian[n_cameras + n_sizes :, n_cameras + n_sizes :] += prior.hessian
        return out

    def _surfaces(self, person: int, body: BodyModel) -> Surfaces | None:
        for seen, views in zip(self._seen, self._views, strict=True):
            if seen.person == person and views:
                return views[0].residuals.resized(body)
        return None

    def _model(self, seen: SeenPerson) -> BodyModel:
        return self._parameters[seen.person].base


class _Resized(NamedTuple):
    """A body at the sizes of a step."""

    body: BodyModel
    by_sizes: SizeArrays
    """Derivatives of its sizes."""
    surfaces: Surfaces | None
    """Its shapes, and those of other people; None where no view shows it."""


def sums_of_pieces(
    pieces: PieceSums, body: BodyModel, kinematics: Kinematics, camera: Camera, correction: Array
) -> tuple[Array, Array]:
    """Sum the residuals of a view by the motions of parts and the corrections of its camera; see `rig_kernels`.

    Args:
        pieces: residuals of the view.
        body: at its present sizes.
        kinematics: of its pose.
        camera: with the correction.
        correction: (N_CORRECTIONS,).

    Returns:
        Gradients, (n_parts, N_PART + N_CAMERA), and normal matrices, (n_parts, N_PART + N_CAMERA, N_PART + N_CAMERA).
    """
    n_parts, k = len(body.parts), N_PART + N_CAMERA
    b, M = np.zeros((n_parts, k)), np.zeros((n_parts, k, k))
    half_axes = np.array([s.half_axes for s in body.shapes])
    turn = so3_exp(correction[ROTATION]) if correction[ROTATION].any() else np.eye(3)
    sum_pieces(
        *(pieces.parts, pieces.unit_points, pieces.gradients, pieces.hessians),
        *(kinematics.Ts_world_part, body.centers_part, half_axes, camera.T_camera_world, camera.K, turn, b, M),
    )
    below = np.tril_indices(k, -1)
    M[:, below[0], below[1]] = M[:, below[1], below[0]]
    return b, M


class GroupSums(NamedTuple):
    """Normal equations of a person on a frame, by all corrections and then the unknowns of the body.

    Sums over the motions of parts are converted to the unknowns of the body once for all views, which takes most time.
    """

    gradient: Array
    """(n,)."""
    hessian: Array
    """(n, n); below the diagonal only where `equations` copies it from above."""
    n_cameras: int
    """Number of all corrections."""

    @classmethod
    def zeros(cls, n_cameras: int, n_body: int) -> "GroupSums":
        """Return empty sums."""
        n = n_cameras + n_body
        return cls(np.zeros(n), np.zeros((n, n)), n_cameras)

    def add_camera(self, camera: int, b: Array, M: Array, J: Array, moving: Array, time_s: float) -> None:
        """Add what a view says of its own camera.

        Args:
            camera: index of the camera.
            b: gradients by the motions of parts and the corrections but that of the clock, (n_parts, k).
            M: their normal matrices, (n_parts, k, k).
            J: derivatives of the motions by the unknowns of the body, (n_parts, N_PART, n_body).
            moving: motions of the parts in a second, (n_parts, N_PART).
            time_s: time of the frame, seconds.
        """
        first = camera * N_CORRECTIONS
        at, clock = slice(first, first + TIME), slice(first + TIME, first + N_CORRECTIONS)
        body, delays_s = slice(self.n_cameras, None), np.array([1.0, time_s])  # by offset and drift
        to_body, to_camera = M[:, :N_PART, :N_PART], M[:, N_PART:, :N_PART]
        moved = np.einsum("pij,pj->pi", to_body, moving)
        self.gradient[at] += b[:, N_PART:].sum(axis=0)
        self.gradient[clock] += np.sum(b[:, :N_PART] * moving) * delays_s
        self.hessian[at, at] += M[:, N_PART:, N_PART:].sum(axis=0)
        self.hessian[at, clock] += np.outer(np.einsum("pij,pj->i", to_camera, moving), delays_s)
        self.hessian[clock, clock] += np.sum(moved * moving) * np.outer(delays_s, delays_s)
        flat = J.reshape(-1, J.shape[2])
        self.hessian[at, body] += to_camera.transpose(1, 0, 2).reshape(TIME, -1) @ flat
        self.hessian[clock, body] += np.outer(delays_s, moved.ravel() @ flat)

    def add_body(self, b: Array, M: Array, J: Array) -> None:
        """Add the sums of some views over the motions of the parts; arguments as above, without the corrections."""
        flat, body = J.reshape(-1, J.shape[2]), slice(self.n_cameras, None)
        self.gradient[body] += flat.T @ b.ravel()
        self.hessian[body, body] += flat.T @ (M @ J).reshape(flat.shape)

    def equations(self, cost: float) -> NormalEquations:
        """Return the normal equations, whose hessian is symmetric."""
        upper = np.triu(self.hessian)
        hessian = upper + upper.T
        np.fill_diagonal(hessian, upper.diagonal())
        return NormalEquations(cost, self.gradient, hessian)


def views_of(seen: SeenPerson, corrections: Array) -> list[SeenView]:
    """Return the views that show anything of a person, with the residuals of each."""
    out = []
    for i, (view, correction) in enumerate(zip(seen.views, corrections, strict=True)):
        if not len(view.points_px):
            continue
        delay_s = seen.ahead_s[i] + later_s(correction, seen.time_s)
        then = seen.moved(seen.body.model.retract(seen.body.values, seen.path.step(delay_s)))
        evidence = replace(view, camera=corrected(view.camera, correction))
        out.append(SeenView(i, view, ContourResiduals([evidence], then.bodies, seen.person)))
    return out
