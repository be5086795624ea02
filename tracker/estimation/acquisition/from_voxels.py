"""Fit the sizes of a body to the labelled voxels of several frames (MTHC01 Sect. 3 and 4), as a start for the contours.

Part sizes follow from the eigenvalues of each part's voxels, and joints from the part sizes. A visual hull is thicker
than its person, and labels end where the body has its joints. Therefore the hull of the body's own silhouettes is
measured in the same way, and only the difference counts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.dimensions import restate_height
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.threads import map_parallel
from tracker.errors import TrackerError
from tracker.estimation.acquisition.part_derivatives import (
    TIPS,
    FigureSizes,
    figure_by_sizes,
    parts_by_unknowns,
    points_by_sizes,
)
from tracker.estimation.acquisition.size_fit import SizeStart
from tracker.estimation.acquisition.size_parameters import SizeArrays, SizeParameters
from tracker.estimation.fitting.bundle import ArrowEquations
from tracker.estimation.fitting.gauss_newton import NormalEquations, PosePrior
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.frame_voxels import FrameVoxels, carve_around
from tracker.estimation.voxel.labels import label_voxels
from tracker.estimation.voxel.measurement import PartAxes, linearize, measure_parts
from tracker.estimation.voxel.resolved_parts import ResolvedParts, find_resolved_parts
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.estimation.voxel.state import FilterState
from tracker.evidence.contours.body_silhouette import body_silhouette
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.geometry.arrays import TINY, Array, Mask, intersection_over_union

_KINDS = ("height", "build", "length", "girth", "free_end")
"""Kinds of sizes that voxels show; the places of joints in the flesh are left to the contours."""
_TIP_SHARE = 0.99
"""Quantile of a part's voxels along its axis that counts as its tip."""


@dataclass(frozen=True)
class VoxelSizeSettings:
    """Settings of the fit."""

    voxels: VoxelSettings = field(default_factory=lambda: VoxelSettings(voxel_m=VOXEL_M))
    """Size of the voxels, how they are labelled, and the noise of their measurements."""
    rounds: int = 3
    """Number of times that voxels are labelled and sizes are updated."""
    trust_rad: float = 0.05
    """Standard deviation of the initial angles, rad: poses that were tracked by contours are better than those by
    voxels."""
    trust_m: float = 0.02
    """Standard deviation of the initial position, metres."""


class SilhouettedPerson(NamedTuple):
    """A person on one frame, with the silhouettes of all views."""

    frame: int
    silhouettes: tuple[ViewSilhouette, ...]
    bodies: tuple[PosedBody, ...]
    """The person in the present body, then the others."""


class VoxelSizes(NamedTuple):
    """Sizes and poses that fit the voxels of some frames."""

    parameters: SizeParameters
    """The sizes that were fitted, relative to the body before."""
    sizes: Array
    """(n_sizes,)."""
    body: BodyModel
    """The body with these sizes; its height is its stature."""
    covariance: Array
    """Of the sizes, (n_sizes, n_sizes), whatever the poses are."""
    frames: tuple[int, ...]
    poses: tuple[Array, ...]
    """Pose of each frame, (n_values,)."""
    overlap_before: float
    """Volume shared by the hulls of the footage and of the body before, as a share of that of both; the mean."""
    overlap_after: float
    """The same with this body and these poses."""

    @property
    def start(self) -> SizeStart:
        """The start of a fit to contours."""
        return SizeStart(self.sizes, self.covariance, dict(zip(self.frames, self.poses, strict=True)))


def fit_sizes_to_voxels(
    parameters: SizeParameters,
    frames: Sequence[SilhouettedPerson],
    settings: VoxelSizeSettings,
    report: Callable[[float], None] = lambda share: None,
) -> VoxelSizes:
    """Fit sizes and poses to the labelled voxels of several frames, by Gauss-Newton steps.

    Args:
        parameters: the sizes; their prior has the mean 0.
        frames: the frames, with the initial poses in the body of the parameters.
        settings: of the fit.
        report: receives the share of the work that is done, 0 to 1. An exception that it raises ends the fit.

    Raises:
        TrackerError: the body lacks the joints of ten parts, or no frame shows voxels near it.
    """
    sizes, poses = np.zeros(len(parameters.names)), [f.bodies[0].values for f in frames]
    free, overlaps, covariance = parameters.of_kinds(*_KINDS), list[float](), np.eye(len(sizes))
    by_figure = figure_by_sizes(parameters, sizes)  # hardly changes with the sizes
    for number in range(settings.rounds + 1):
        report(number / (settings.rounds + 1))
        body, by_sizes = parameters.body(sizes), parameters.derivatives(sizes)
        problems = [_Frame(f, body, p, settings) for f, p in zip(frames, poses, strict=True)]
        found = _linearized(problems, by_sizes, by_figure)
        if not any(f.equations.gradient[: len(sizes)].any() for f in found):
            raise TrackerError(
                f"expected voxels of the person on frames {', '.join(str(f.frame) for f in frames)}, found none around "
                "the body; check the background or the masks, and that the body is where the person is"
            )
        overlaps.append(float(np.mean([f.overlap for f in found])))
        if number < settings.rounds:
            step, steps, covariance = _step(parameters, sizes, free, [f.equations for f in found])
            sizes = sizes + step
            poses = [body.move(p, s) for p, s in zip(poses, steps, strict=True)]
    body = restate_height(parameters.body(sizes), parameters.base)
    return VoxelSizes(
        parameters, sizes, body, covariance, tuple(f.frame for f in frames), tuple(poses), overlaps[0], overlaps[-1]
    )


def _linearized(problems: Sequence["_Frame"], by_sizes: SizeArrays, by_figure: FigureSizes) -> "list[_FrameEquations]":
    # The first frame alone fills the tables of lenses, which the others share.
    first, *rest = problems
    return [first.linearize(by_sizes, by_figure), *map_parallel(lambda p: p.linearize(by_sizes, by_figure), rest)]


def _step(
    parameters: SizeParameters, sizes: Array, free: Mask, frames: Sequence[NormalEquations]
) -> tuple[Array, Array, Array]:
    """Solve for the sizes that are free with the poses eliminated.

    Returns:
        The step of the sizes, (n_sizes,), that of each pose, (F, n_dofs), and the covariance, (n_sizes, n_sizes).
    """
    n, precision = len(sizes), 1 / parameters.sigmas**2
    equations = ArrowEquations.zeros(n, len(frames), parameters.base.n_dofs)
    equations.gradient[:], equations.hessian[:] = precision * sizes, np.diag(precision)
    for i, of_frame in enumerate(frames):
        equations.add(i, of_frame)
    held = equations.held(free, np.ones(equations.own_gradients.shape, np.bool_))
    covariance, at = np.diag(1 / precision), np.ix_(free, free)
    covariance[at] = np.linalg.inv(held.reduced()[1][at])
    return *held.step(0.0), covariance


class _FrameEquations(NamedTuple):
    equations: NormalEquations
    """By the sizes and then the pose."""
    overlap: float
    """Of the hulls of the footage and of the body."""


class _Measured(NamedTuple):
    is_resolved: NDArray[np.bool_]
    """Which parts stand apart, (10,)."""
    parts: PartAxes
    tips: Array
    """Place of the farthest voxels of each part along its axis, (10,), metres; 0 where it has no free end."""


class _Frame:
    """One frame at a body and a pose."""

    def __init__(self, frame: SilhouettedPerson, body: BodyModel, pose: Array, settings: VoxelSizeSettings) -> None:
        self._frame, self._settings = frame, settings
        self._bodies = (PosedBody(body, pose), *frame.bodies[1:])
        self._states = [state_of(b.model, [b.values], 1.0, settings.voxels) for b in self._bodies]

    def linearize(self, by_sizes: SizeArrays, by_figure: FigureSizes) -> _FrameEquations:
        """Return the normal equations by the sizes and the pose, with the priors of the pose."""
        size_m = self._settings.voxels.voxel_m
        seen = carve_around(self._frame.silhouettes, self._states, size_m)
        own = carve_around(self._own_silhouettes(), self._states, size_m)
        found = self._measurements(self._measured(seen), self._measured(own), by_sizes, by_figure)
        overlap = intersection_over_union(seen.voxels.occupied, own.voxels.occupied)
        return _FrameEquations(self._with_priors(found), overlap)

    def _measurements(
        self, seen: _Measured, own: _Measured, by_sizes: SizeArrays, by_figure: FigureSizes
    ) -> NormalEquations:
        """Return the normal equations of the measurements, relative to those of the body's own hull."""
        (body, *_), (state, *_), noise = self._bodies, self._states, self._settings.voxels.measurement
        n = by_figure.half_sizes.shape[-1] + body.model.n_dofs
        found = _relative(state, seen.parts, own.parts)
        used = seen.is_resolved & own.parts.is_measured & found.is_measured
        rows = linearize(state, found, noise, used, True)
        if rows is None:
            return NormalEquations(0.0, np.zeros(n), np.zeros((n, n)))
        points = points_by_sizes(body.model, body.kinematics, by_sizes)
        J = parts_by_unknowns(body, state, by_figure, points)[used]
        # Of each part: its centre, its turn, and two half sizes with the tip or three of them.
        residuals = rows.residual.reshape(len(J), -1).copy()
        at = np.arange(rows.residual.size).reshape(len(J), -1)
        R = rows.noise[at[:, :, None], at[:, None, :]]
        for row, i in enumerate(np.flatnonzero(used)):
            if TIPS[i]:
                residuals[row, 8] = seen.tips[i] - own.tips[i]
                J[row, 8] = state.rotations[i, :, 2] @ J[row, :3] + TIPS[i] * J[row, 8]
            else:  # labels end at the joints of the prediction
                R[row, 8, 8] = (noise.along * state.sizes[i, 2]) ** 2
        WJ = np.linalg.solve(R, J)
        gradient = -np.einsum("pij,pi->j", WJ, residuals)
        return NormalEquations(0.0, gradient, np.einsum("pij,pik->jk", J, WJ, optimize=True))

    def _with_priors(self, found: NormalEquations) -> NormalEquations:
        """Add the priors of the pose."""
        settings, body = self._settings, self._bodies[0]
        sigma = np.where(body.model.dof_is_length, settings.trust_m, settings.trust_rad)
        first, H, g = len(found.gradient) - body.model.n_dofs, found.hessian.copy(), found.gradient.copy()
        for prior in (PosePrior(self._frame.bodies[0].values, 1 / sigma), PosePrior.of_spreads(body.model)):
            own = prior.linearize(body.model, body.values, body.kinematics)
            H[first:, first:] += own.hessian
            g[first:] += own.gradient
        return NormalEquations(0.0, g, H)

    def _own_silhouettes(self) -> list[ViewSilhouette]:
        """Return the silhouettes of the bodies themselves; empty views stay empty."""
        return [
            s if s.is_empty else s._replace(mask=body_silhouette(self._bodies, s.camera))
            for s in self._frame.silhouettes
        ]

    def _measured(self, frame: FrameVoxels) -> _Measured:
        """Return the measurements of the person by the voxels of a frame."""
        settings, state = self._settings.voxels, self._states[0]
        points = frame.voxels.points_world
        labels = label_voxels(points, self._states, settings.voxel_m, settings.label_rule)
        levels = find_resolved_parts(ResolvedParts.finest(), state, frame.voxels, labels.labels, 0, 1)
        tips = np.zeros(len(TIPS))
        for i in np.flatnonzero(TIPS):
            own = points[labels.labels == i]
            if len(own):
                along = TIPS[i] * (own - state.centers[i]) @ state.rotations[i, :, 2]
                tips[i] = TIPS[i] * float(np.quantile(along, _TIP_SHARE))
        parts = measure_parts(state, labels.clouds.of_person(0), settings.voxel_m, settings.by_size)
        return _Measured(levels.is_resolved, parts, tips)


def _relative(state: FilterState, seen: PartAxes, own: PartAxes) -> PartAxes:
    """Return the measurements as if the body's own hull had measured the body itself."""
    sizes = state.sizes * seen.sizes / own.sizes
    volumes = 2 * np.pi * state.sizes.prod(axis=1) * np.where(state.figure.is_ellipsoid, 2 / 3, 1.0)
    return seen._replace(
        offsets=seen.offsets - own.offsets,
        turns=seen.turns - own.turns,
        sizes=sizes,
        variances=(state.figure.sigma_shares * sizes) ** 2,
        volumes=volumes * seen.volumes / np.maximum(own.volumes, TINY),
    )
