"""Contour residuals: contours of a posed body against edges (KRH08 Sect. 5, made symmetric and robust).

Both directions of the chamfer distance are residuals. A visible piece of contour reads its distance to the nearest
edge, and the slope of the distance image there (KRH08 Eq. 59-61, with the derivative of the bilinear distance). An edge
point finds the nearest piece of contour of similar direction (Eq. 58). The derivative of a residual by the pose is that
of the surface point under the piece. Across its tangent the occluding contour moves with that material point, because
the contour slides on the surface along the line of sight only (KRH08 Sect. 4).

Residuals are not stored one by one. Their squares and gradients are summed for each piece in the image, then for each
part. A point X of a part moves by the part's spatial twist (omega, v) as omega x X + v. The row of a residual is
therefore (X x g, g), with g its derivative by X. Only the parts' 6x6 normal matrices are converted to the degrees of
freedom, whatever the shapes of the parts.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics, Tree, forward_kinematics
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.compute.jit import FAR, njit
from tracker.estimation.fitting.contour_arrays import (
    ContourMotion,
    ContourTerm,
    ViewArrays,
    points_to_match,
    scratch_buffer,
    sums_buffer,
)
from tracker.estimation.fitting.contour_kernels import COST_ONLY, WITH_JACOBIAN, accumulate_normal_equations
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.estimation.fitting.twists import twists_to_dofs
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import StaticContours, static_contours_buffer
from tracker.evidence.contours.surfaces import Surfaces, resized_surfaces, surfaces_of
from tracker.evidence.view_evidence import ViewEvidence, outliers_px
from tracker.geometry.arrays import Array, FloatArray, IntArray
from tracker.geometry.cameras import Camera, projections
from tracker.geometry.segment_distance import stack_points

CAPTURE = 2.0
"""Edge points farther than this many outlier distances from the predicted contours are left out for good. Halved and
doubled: no change on `walk` and `fast_arms` from joints (acquisition.py)."""

MIN_DECREASE = 0.1
"""Smallest decrease of the cost for another Gauss-Newton iteration where poses are only compared. Near its minimum the
cost is rougher than this, because points change their piece and pieces appear and vanish."""


@dataclass(frozen=True)
class MatchSettings:
    """Weights and scales of the residuals between contours and edges."""

    scale: float = 0.4
    """Distance at which the influence of a residual falls to a quarter (Geman-McClure), in outlier distances."""
    turn: float = 0.5
    """Squared distance that an edge at right angles to the contour counts, in squared outlier distances."""
    model_to_image: float = 0.5
    """Weight of the model-to-image residuals; 0 leaves them out."""
    image_to_model: float = 0.5
    """Weight of the image-to-model residuals; 0 leaves them out."""
    edges: float = 1.0
    """Weight of edge points in the image; 0 leaves them out."""
    silhouette: float = 0.5
    """Weight of points of the silhouette's contour in a fully trusted view."""
    information_per_px: float = 0.0125
    """Information of one pixel of contour: 1 / (variance in px^2 times the length of correlated errors, px)."""
    motion: Literal["across", "rigid", "sliding"] = "across"
    """How contour points move in the derivatives of the model-to-image residuals. `across` counts the motion across
    the contour only. `rigid` counts the whole motion of the material point (A of KRH08 Eq. 22). `sliding` adds the
    motion of the contour on the surface (B of Eq. 31)."""


def paper_match(motion: Literal["rigid", "sliding"] = "sliding") -> MatchSettings:
    """Return the weights of KRH08 Eq. 60: model to image, a sum of squares in px^2 with every pixel of contour.

    Residuals of any size count in full: the scale is beyond any.
    """
    return MatchSettings(
        scale=float(FAR), model_to_image=1.0, image_to_model=0.0, information_per_px=1.0, motion=motion
    )


class PartCosts(NamedTuple):
    """Fit of the contours of each part, for display and for assessing a pose."""

    length_px: Array
    """Visible contour within the images, (V, n_parts), working px."""
    forward_px: Array
    """Mean distance of that contour to the edges, with outliers cut off, (V, n_parts), working px; NaN if nothing is
    visible."""
    points: Array
    """Number of points of edges and silhouette that the part explains, (V, n_parts)."""


class PieceSums(NamedTuple):
    """Residuals at the visible pieces of contour of one person in one view, summed piece by piece."""

    parts: IntArray
    """Index of the person's part of each piece, (N,)."""
    points_px: Array
    """Middle of each piece, (N, 2), working px."""
    unit_points: Array
    """The same in the unit coordinates of its part, (N, 3)."""
    gradients: Array
    """Derivative of the cost by the image of the piece, (N, 2), per px."""
    hessians: Array
    """Gauss-Newton's second derivative by it, (N, 2, 2), per px^2."""

    @property
    def pulled(self) -> "PieceSums":
        """The pieces that have residuals."""
        at = self.hessians.any(axis=(1, 2))
        return PieceSums(
            self.parts[at], self.points_px[at], self.unit_points[at], self.gradients[at], self.hessians[at]
        )


class ContourResiduals:
    """Residuals of one person's contours against the edges of all views; see `ResidualBlock`.

    The other people are fixed. They occlude, and take the edges that are nearer to them. Only one thread may use an
    object at a time, because its kernels work in its buffers; `clone_for_thread` makes an object for another
    thread.
    """

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        bodies: Sequence[PosedBody],
        person: int = 0,
        settings: MatchSettings | None = None,
        theta_px: float | None = None,
        everywhere: bool = False,
        contours: Sequence[occluding_contours.Contour] | None = None,
    ) -> None:
        """Prepare the evidence for the kernels.

        Args:
            views: evidence of each view.
            bodies: all bodies in the scene, as predicted.
            person: index of the body that is fitted.
            settings: weights and scales.
            theta_px: outlier distance, px of the footage; by default that of each view.
            everywhere: keep edge points at any distance from the predicted contours, for poses far from the prediction.
            contours: predicted contours of all bodies in each view; traced here by default.
        """
        settings = settings or MatchSettings()
        self._models, self._person = tuple(b.model for b in bodies), person
        self._model = bodies[person].model
        self._own = parts_of([b.model for b in bodies], person)
        thetas = outliers_px(views, theta_px)
        near: Sequence[occluding_contours.Contour | None] = [None] * len(views)
        if not everywhere:
            near = contours or [occluding_contours.trace(bodies, v.camera) for v in views]
        points = [
            points_to_match(v, contour, CAPTURE * theta, settings.edges, settings.silhouette)
            for v, contour, theta in zip(views, near, thetas.tolist(), strict=True)
        ]
        sizes = [v.camera.size for v in views]
        of_views = stack_points(points, sizes)
        weights = settings.information_per_px * np.array([settings.model_to_image, settings.image_to_model])
        arrays = ViewArrays(
            *projections([v.camera for v in views]),
            np.array(sizes, dtype=np.int64),
            np.concatenate([v.distance.ravel() for v in views]),
            of_views.points,
            of_views.firsts,
            of_views.rows,
            thetas,
            # A view without edges does not count; its distance image is flat.
            np.array([weights if len(v.points_px) else 0 * weights for v in views]),
        )
        self._max_pieces = occluding_contours.contour_room([v.camera for v in views], len(bodies))
        surfaces, Ts, own = (
            surfaces_of(tuple(b.model for b in bodies)),
            occluding_contours.part_poses(bodies),
            self._own,
        )
        self._term = ContourTerm(
            Ts, own.start, own.stop, surfaces, arrays, settings.scale, settings.turn,
            int(ContourMotion[settings.motion.upper()]),  # numba is slow to take members of an enumeration
            self._static_buffer(np.arange(own.start, own.stop), len(Ts), arrays),
            scratch_buffer(surfaces, self._max_pieces, arrays.points.shape[1]), sums_buffer(len(Ts), len(views)),
        )  # fmt: skip

    def _static_buffer(self, parts: IntArray, n_parts: int, arrays: ViewArrays) -> StaticContours:
        moves = np.zeros(n_parts, np.bool_)
        moves[parts] = True
        return static_contours_buffer(len(arrays.sizes), self._max_pieces, arrays.points.shape[1], moves)

    def resized(self, model: BodyModel) -> Surfaces:
        """Return the shapes of all bodies, the person's at other sizes, for `piece_sums`."""
        models = tuple(model if i == self._person else m for i, m in enumerate(self._models))
        return resized_surfaces(models, self._term.surfaces)

    def with_information(self, factor: float) -> "ContourResiduals":
        """Return the same residuals with their information multiplied by a factor. Both use the same buffers."""
        out, views = copy(self), self._term.views
        out._term = self._term._replace(views=views._replace(weights=factor * views.weights))
        return out

    def piece_sums(
        self, kinematics: Kinematics, surfaces: Surfaces | None = None, camera: Camera | None = None
    ) -> tuple[float, PieceSums]:
        """Return the cost of a pose and the residuals piece by piece.

        For residuals of a single view, whose pieces are those in the buffers.

        Args:
            kinematics: of the pose.
            surfaces: shapes of the bodies at other sizes, see `resized`; several views share them.
            camera: another one of the same pixels.
        """
        term, own = self._term, self._own
        assert len(term.views.sizes) == 1
        if surfaces is not None:
            term = term._replace(surfaces=surfaces)
        if camera is not None:
            term.static.Ts[:] = np.nan  # contours of static parts are traced again
            views = term.views._replace(P=camera.projection[None], eyes=camera.center_world[None])
            term = term._replace(views=views)
        term.Ts[own] = kinematics.Ts_world_part
        cost, scratch = accumulate_normal_equations(term, WITH_JACOBIAN), term.scratch
        return cost, PieceSums(*_unpacked(scratch.firsts[own.start : own.stop + 1], scratch.pieces, scratch.pulls))

    def restricted_to(self, parts: IntArray) -> "ContourResiduals":
        """Return the residuals for poses that differ in some parts of the person only; faster.

        Residuals of other parts count in the cost, but not in the derivatives. Poses in which other parts move too are
        evaluated correctly, but more slowly. Both use the same buffers.

        Args:
            parts: indices of the parts that move, (n,).
        """
        out, term = copy(self), self._term
        static = self._static_buffer(self._own.start + parts, len(term.Ts), term.views)
        out._term = term._replace(static=static)
        return out

    def clone_for_thread(self) -> "ContourResiduals":
        """Return the same residuals for another thread: the evidence is shared, the scratch is not."""
        out, term = copy(self), self._term
        moving, n_points = np.flatnonzero(term.static.moves), term.views.points.shape[1]
        out._term = term._replace(
            Ts=term.Ts.copy(),
            static=self._static_buffer(moving, len(term.Ts), term.views),
            scratch=scratch_buffer(term.surfaces, self._max_pieces, n_points),
            sums=sums_buffer(len(term.Ts), len(term.views.sizes)),
        )
        return out

    def term(self, model: BodyModel) -> ContourTerm:
        """Return the arguments of the kernels, for the person's model."""
        assert model is self._model
        return self._term

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        term, own = self.term(model), self._own
        cost = self._accumulate(kinematics)
        return equations_of_twists(model, kinematics, cost, term.sums.M[own], term.sums.b[own])

    def costs(self, candidates: Array) -> Array:
        """Return the costs alone of many poses, (C, n_values) to (C,)."""
        return np.asarray(self.view_costs(candidates).sum(axis=1))

    def view_costs(self, candidates: Array) -> Array:
        """Return the costs alone of many poses in each view, (C, n_values) to (C, V)."""
        model, term = self._model, self._term
        out = np.empty((len(candidates), len(term.views.sizes)))
        _score(np.array(candidates, np.float64, order="C"), model.tree, model.n_dofs, term, out)
        return out

    def part_costs(self, pose: Array) -> PartCosts:
        """Return how well each part of the person fits in a pose."""
        self._accumulate(self._model.kinematics(pose), with_jacobian=False)
        sums = self._term.sums
        length, distance, points = np.moveaxis(sums.parts[:, self._own], -1, 0).copy()
        forward = np.divide(distance, length, out=np.full_like(length, np.nan), where=length > 0)
        return PartCosts(length, forward, points)

    def _accumulate(self, kinematics: Kinematics, with_jacobian: bool = True) -> float:
        self._term.Ts[self._own] = kinematics.Ts_world_part
        return accumulate_normal_equations(self._term, with_jacobian)


def equations_of_twists(model: BodyModel, kinematics: Kinematics, cost: float, M: Array, b: Array) -> NormalEquations:
    """Return normal equations by the degrees of freedom from those by the parts' twists; see `twists_to_dofs`.

    Args:
        model: the body.
        kinematics: of the pose.
        cost: of the pose.
        M: normal matrix of each part's twist, upper triangles, (n_parts, 6, 6).
        b: gradient by each part's twist, (n_parts, 6).
    """
    gradient, hessian = np.empty(model.n_dofs), np.empty((model.n_dofs, model.n_dofs))
    twists_to_dofs(
        M, b, kinematics.axes_world, kinematics.origins_world, model.dof_is_length, model.dof_joint,
        model.tree.parents, model.moves, gradient, hessian,
    )  # fmt: skip
    return NormalEquations(cost, gradient, hessian)


@njit(nogil=True, cache=True)
def _score(candidates: Array, tree: Tree, n_dofs: int, term: ContourTerm, out: Array) -> None:
    """Fill the costs in each view, (C, V), of poses of the fitted person, (C, n_values)."""
    axes, origins = np.empty((n_dofs, 3)), np.empty((n_dofs, 3))
    for c in range(candidates.shape[0]):
        forward_kinematics(candidates[c], tree, term.Ts[term.first : term.last], axes, origins)
        accumulate_normal_equations(term, COST_ONLY)
        out[c] = term.sums.costs


@njit(nogil=True, cache=True)
def _unpacked(
    firsts: IntArray, pieces: FloatArray, pulls: Array
) -> tuple[IntArray, Array, Array, Array, Array]:  # fmt: skip
    """Return the fields of `PieceSums` from the buffers of `Scratch`, from the parts' first pieces on, (P + 1,)."""
    n = firsts[-1] - firsts[0]
    parts, points, units = np.empty(n, np.int64), np.empty((n, 2)), np.empty((n, 3))
    gradients, hessians = np.empty((n, 2)), np.empty((n, 2, 2))
    for part in range(len(firsts) - 1):
        for k in range(firsts[part], firsts[part + 1]):
            i, u, v = k - firsts[0], np.float64(pieces[3, k]), np.float64(pieces[4, k])
            parts[i] = part
            for j in range(2):
                points[i, j] = pieces[j, k]
            for j in range(3):
                units[i, j] = pieces[5 + j, k]
            gradients[i, 0], gradients[i, 1] = pulls[1, k] * u + pulls[5, k], pulls[1, k] * v + pulls[6, k]
            hessians[i, 0, 0], hessians[i, 1, 1] = pulls[0, k] * u * u + pulls[2, k], pulls[0, k] * v * v + pulls[4, k]
            hessians[i, 0, 1] = hessians[i, 1, 0] = pulls[0, k] * u * v + pulls[3, k]
    return parts, points, units, gradients, hessians
