"""Fit corrections of cameras, sizes of bodies and poses to the contours of several frames at once.

View c of frame k sees the pose q_k + p_k(d_c + r_c T_k), with p_k the way of the tracked pose. Corrections
and sizes are shared unknowns, the pose of each person on each frame is their own (`bundle`). Residuals are those of the
tracker (`contour_residuals`).
"""

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.compute.threads import map_parallel
from tracker.estimation.acquisition.part_motions import motions_by_pose, motions_by_sizes
from tracker.estimation.acquisition.piece_kernels import N_COLUMNS, N_PART, OF_PART, sum_of_camera, sum_pieces
from tracker.estimation.acquisition.size_parameters import SizeArrays, SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations
from tracker.estimation.fitting.contour_residuals import ContourResiduals, PieceSums
from tracker.estimation.fitting.gauss_newton import NormalEquations, PosePrior, pressed_against_limit
from tracker.evidence.contours.surfaces import Surfaces
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION, corrected, later_s, with_step
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp

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
    after the other, then the sizes `SIZE_KINDS` of one person after the other."""

    def __init__(
        self, seen: Sequence[SeenPerson], parameters: Sequence[SizeParameters], sigmas: Array, corrections: Array,
        with_sizes: bool = True,
    ) -> None:  # fmt: skip
        """Prepare the evidence around the present poses and cameras.

        Args:
            seen: people on frames.
            parameters: sizes of each person's body; their priors have the mean 0.
            sigmas: standard deviations of the corrections in their prior, (N_CORRECTIONS,).
            corrections: present ones of each camera, (V, N_CORRECTIONS); contours are predicted by them.
            with_sizes: whether sizes are unknown.
        """
        self._seen, self._parameters = seen, parameters
        self._sigmas = np.tile(sigmas, (len(corrections), 1))
        self._free_corrections = np.zeros(self._sigmas.shape, np.bool_)
        self._views = map_parallel(lambda s: views_of(s, corrections), seen)
        self._priors = [PosePrior.of_spreads(p.base) for p in parameters]
        self._fitted = [np.flatnonzero(p.of_kinds(*SIZE_KINDS) & with_sizes) for p in parameters]
        """Indices of each person's sizes that are unknown."""
        ends = np.cumsum([self._sigmas.size, *map(len, self._fitted)]).tolist()
        self._ranges = tuple(itertools.starmap(slice, itertools.pairwise(ends)))
        """Their places among the shared unknowns."""
        self.n_shared = ends[-1]
        """Number of shared unknowns."""
        self._n_own = max(p.base.n_dofs for p in parameters)
        """Most degrees of freedom of a person; those that others lack are held."""

    def with_free(self, columns: IntArray) -> "RigProblem":
        """Return the same problem in which some corrections may change, by their places among those of all cameras."""
        out = copy(self)
        out._free_corrections = np.zeros(self._sigmas.shape, np.bool_)
        out._free_corrections.ravel()[columns] = True
        return out

    def moved(self, state: RigState, shared: Array, own: Array) -> RigState:
        """See `BundleProblem`."""
        steps = shared[: self._sigmas.size].reshape(self._sigmas.shape)
        poses, sizes = [], [s.copy() for s in state.sizes]
        for of_person, fitted, at in zip(sizes, self._fitted, self._ranges, strict=True):
            of_person[fitted] += shared[at]
        for seen, pose, step in zip(self._seen, state.poses, own, strict=True):
            model = self._model(seen)
            poses.append(model.clip(model.retract(pose, step[: model.n_dofs])))
        return RigState(
            np.array([with_step(c, s) for c, s in zip(state.corrections, steps, strict=True)]),
            tuple(sizes),
            tuple(poses),
        )

    def free(self, state: RigState, equations: ArrowEquations) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """See `BundleProblem`."""
        shared = np.ones(self.n_shared, np.bool_)
        shared[: self._sigmas.size] = self._free_corrections.ravel()
        own = np.zeros(equations.own_gradients.shape, np.bool_)
        for seen, pose, gradient, out in zip(self._seen, state.poses, equations.own_gradients, own, strict=True):
            model = self._model(seen)
            out[: model.n_dofs] = ~pressed_against_limit(model, pose, gradient[: model.n_dofs])
        return shared, own

    def linearize(self, state: RigState, below: float = np.inf) -> ArrowEquations:
        """See `BundleProblem`."""
        resized, groups = [self._resized(i, sizes) for i, sizes in enumerate(state.sizes)], range(len(self._seen))
        residuals = map_parallel(lambda g: self._residuals(g, state, resized[self._seen[g].person]), groups)
        priors = self._shared_priors(state)
        cost = sum(r.cost for r in residuals)
        cost += sum(0.5 * float(np.sum((deviations / sigmas) ** 2)) for _, deviations, sigmas in priors)
        out = ArrowEquations.zeros(self.n_shared, len(self._seen), self._n_own)._replace(cost=cost)
        if cost >= below:
            return out
        found = map_parallel(lambda g: self._summed(g, state, resized[self._seen[g].person], residuals[g]), groups)
        for group, (seen, own) in enumerate(zip(self._seen, found, strict=True)):
            self._enter(out, group, seen.person, own)
        for at, deviations, sigmas in priors:
            out.gradient[at] += deviations / sigmas**2
            out.hessian[at, at] += np.diag(1 / sigmas**2)
        return out

    def _shared_priors(self, state: RigState) -> list[tuple[slice, Array, Array]]:
        rows = [(slice(0, self._sigmas.size), state.corrections.ravel(), self._sigmas.ravel())]
        for at, sizes, parameters, fitted in zip(
            self._ranges, state.sizes, self._parameters, self._fitted, strict=True
        ):
            rows.append((at, sizes[fitted], parameters.sigmas[fitted]))
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
        prior = self._priors[seen.person].linearize(body, pose, kinematics)
        cost, moments = prior.cost, dict[float, Kinematics]()
        for camera, evidence, residuals in self._views[group]:
            delay_s = float(seen.ahead_s[camera] + later_s(state.corrections[camera], seen.time_s))
            if delay_s not in moments:
                then = body.kinematics(body.retract(pose, seen.path.step(delay_s))) if delay_s else kinematics
                moments[delay_s] = then
            shown_by = corrected(evidence.camera, state.corrections[camera])
            own_cost, pieces = residuals.piece_sums(moments[delay_s], resized.surfaces, shown_by)
            cost += own_cost
            views.append(_SeenPieces(camera, shown_by, delay_s, pieces))
        return _GroupResiduals(cost, prior, moments, views)

    def _summed(self, group: int, state: RigState, resized: "_Resized", found: "_GroupResiduals") -> NormalEquations:
        """Return the normal equations of a person on a frame: by all corrections, the sizes, and the pose."""
        body, by_sizes, _, half_axes = resized
        seen, n_sizes, n_cameras = self._seen[group], by_sizes.joints.shape[-1], self._sigmas.size
        sums = GroupSums.zeros(n_cameras, n_sizes + body.n_dofs, len(body.parts))
        for delay_s, kinematics in found.moments.items():
            J = part_motions(body, kinematics, by_sizes)
            moving, of_views = J[:, :, n_sizes:] @ seen.path.velocity(delay_s), PartSums.zeros(len(body.parts))
            for view in found.views:
                if view.delay_s == delay_s:
                    of_view = sums_of_pieces(view.pieces, body, kinematics, view.shown_by, half_axes)
                    correction = state.corrections[view.camera]
                    sums.add_camera(view.camera, of_view, view.shown_by, correction, moving, seen.time_s)
                    of_views.add(of_view)
            sums.add_body(of_views, J)
        out = sums.equations(found.cost)
        out.gradient[n_cameras + n_sizes :] += found.prior.gradient
        out.hessian[n_cameras + n_sizes :, n_cameras + n_sizes :] += found.prior.hessian
        return out

    def _resized(self, person: int, sizes: Array) -> "_Resized":
        """Return a person's body at other sizes, (n_sizes,)."""
        parameters, fitted = self._parameters[person], self._fitted[person]
        body, by_sizes = parameters.body(sizes), parameters.derivatives(sizes)
        return _Resized(
            body, SizeArrays(*(by[..., fitted] for by in by_sizes)), self._surfaces(person, body),
            np.array([s.half_axes for s in body.shapes]),
        )  # fmt: skip

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
    """Derivatives by the unknown sizes."""
    surfaces: Surfaces | None
    """Its shapes, and those of other people; None where no view shows it."""
    half_axes: Array
    """Of each shape, (n_parts, 3), metres."""


class _SeenPieces(NamedTuple):
    """Residuals of a person in one view."""

    camera: int
    shown_by: Camera
    """With its correction."""
    delay_s: float
    """Time by which the picture was taken later than the frame, seconds."""
    pieces: PieceSums


class _GroupResiduals(NamedTuple):
    """Residuals of a person on a frame."""

    cost: float
    """With that of the prior."""
    prior: NormalEquations
    """Of the pose."""
    moments: dict[float, Kinematics]
    """The person at each time at which a picture was taken, by how much later than the frame it is, seconds."""
    views: list[_SeenPieces]


class PartSums(NamedTuple):
    """Residuals summed by the columns of the parts, see `piece_kernels`."""

    b: Array
    """Gradients, (n_parts, N_COLUMNS)."""
    M: Array
    """Normal matrices, (n_parts, N_COLUMNS, N_COLUMNS)."""

    @classmethod
    def zeros(cls, n_parts: int) -> "PartSums":
        """Return empty sums."""
        return cls(np.zeros((n_parts, N_COLUMNS)), np.zeros((n_parts, N_COLUMNS, N_COLUMNS)))

    def add(self, other: "PartSums") -> None:
        """Add the sums of other residuals."""
        self.b[:] += other.b
        self.M[:] += other.M


def sums_of_pieces(
    pieces: PieceSums, body: BodyModel, kinematics: Kinematics, camera: Camera, half_axes: Array
) -> PartSums:
    """Sum the residuals of a view.

    Args:
        pieces: residuals of the view.
        body: at its present sizes.
        kinematics: of its pose.
        camera: with its correction.
        half_axes: of each shape, (n_parts, 3), metres.
    """
    out = PartSums.zeros(len(body.parts))
    sum_pieces(
        *(pieces.parts, pieces.unit_points, pieces.gradients, pieces.hessians),
        *(kinematics.Ts_world_part, body.centers_part, half_axes, camera.T_camera_world, camera.K, *out),
    )
    return out


def part_motions(body: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the columns of the parts by sizes and then the pose, (n_parts, N_PART, n_body)."""
    n_sizes = by_sizes.joints.shape[-1]
    out = np.empty((len(body.parts), N_PART, n_sizes + body.n_dofs))
    out[:, :, :n_sizes] = motions_by_sizes(body, kinematics, by_sizes)[:, :N_PART]
    out[:, :, n_sizes:] = motions_by_pose(body, kinematics)[:, :N_PART]
    return out


class GroupSums(NamedTuple):
    """Normal equations of a person on a frame, by all corrections and then the unknowns of the body.

    Sums over the motions of parts are converted to the unknowns of the body once for all views, which takes most time.
    """

    gradient: Array
    """(n,)."""
    hessian: Array
    """(n, n); the block of body by corrections is filled by `equations`."""
    by_parts: Array
    """Second derivatives by corrections and the motions of parts that are not yet converted, (n_cameras, n_parts *
    N_PART)."""

    @classmethod
    def zeros(cls, n_cameras: int, n_body: int, n_parts: int) -> "GroupSums":
        """Return empty sums."""
        n = n_cameras + n_body
        return cls(np.zeros(n), np.zeros((n, n)), np.zeros((n_cameras, n_parts * N_PART)))

    def add_camera(
        self, camera: int, sums: PartSums, seen_by: Camera, correction: Array, moving: Array, time_s: float
    ) -> None:  # fmt: skip
        """Add what a view says of its own camera.

        Args:
            camera: index of the camera.
            sums: of the view.
            seen_by: the camera with its correction.
            correction: (N_CORRECTIONS,).
            moving: motions of the parts in a second, (n_parts, N_PART).
            time_s: time of the frame, seconds.
        """
        at = slice(camera * N_CORRECTIONS, (camera + 1) * N_CORRECTIONS)
        turn = so3_exp(correction[ROTATION]) if correction[ROTATION].any() else np.eye(3)
        sum_of_camera(
            *sums, seen_by.T_camera_world, turn, moving, time_s, self.gradient[at], self.hessian[at, at],
            self.by_parts[at],
        )  # fmt: skip

    def add_body(self, sums: PartSums, J: Array) -> None:
        """Add the sums of some views, and convert what they say of their cameras.

        Args:
            sums: of these views.
            J: derivatives of the motions of the parts by the unknowns of the body, (n_parts, N_PART, n_body).
        """
        n, flat = len(self.by_parts), J.reshape(-1, J.shape[2])
        weighted = (sums.M[:, OF_PART, OF_PART] @ J).reshape(flat.shape)
        self.gradient[n:] += flat.T @ sums.b[:, OF_PART].ravel()
        self.hessian[:, n:] += np.concatenate([self.by_parts, weighted.T]) @ flat
        self.by_parts[:] = 0.0

    def equations(self, cost: float) -> NormalEquations:
        """Return the normal equations."""
        n = len(self.by_parts)
        self.hessian[n:, :n] = self.hessian[:n, n:].T
        return NormalEquations(cost, self.gradient, self.hessian)


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
