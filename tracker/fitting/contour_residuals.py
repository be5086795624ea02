"""Contours drawn to edges: the image's residuals in the Gauss-Newton (KRH08 Sect. 5, made symmetric and robust).

Both directions of the chamfer distance pull at the pose. A visible piece of the model's contour looks up its distance
to the nearest edge, and the slope of the distance image there (KRH08 Eq. 59-61, with the derivative of the bilinear
distance as DESIGN section 7 has it); an edge point finds the nearest piece of contour that runs its way (Eq. 58). How
a residual changes with the pose is asked of the surface point under the piece: across its tangent the occluding
contour moves as that material point does, because what it slides on the surface it slides along the line of sight
(KRH08 Sect. 4).

Residuals are not kept one by one. Their squares and pulls are summed for each piece in the image, then for each part:
a point X of a part moves by the part's spatial twist (omega, v) as omega x X + v, so the row of a residual is
(X x g, g), g its derivative by X. Only the parts' 6x6 normal matrices are carried over to the degrees of freedom,
whatever the shapes of the parts.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from tracker.body.kinematics import Kinematics, Tree, forward_kinematics
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.contours import occluding_contours
from tracker.contours.static_cache import StaticContours, static_contours_buffer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_kernels import (
    COST_ONLY,
    ContourTerm,
    Scratch,
    Sums,
    ViewArrays,
    accumulate_normal_equations,
    scratch_buffer,
)
from tracker.fitting.gauss_newton import NormalEquations
from tracker.fitting.match_points import points_to_match
from tracker.fitting.twists import twists_to_dofs
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.segment_distance import sort_points, stack_rows

_CAPTURE = 2.0
"""Edge points farther than this many outlier distances from the predicted contours are left out for good."""

MIN_DECREASE = 0.1
"""Smallest decrease of the cost for another Gauss-Newton iteration where poses are only compared. Near its minimum the
cost is rougher than this, because points change their piece and pieces appear and vanish."""


@dataclass(frozen=True)
class MatchSettings:
    """How contours and edges are matched."""

    scale: float = 0.4
    """Distance at which a residual's pull is down to a quarter (Geman-McClure), in outlier distances."""
    turn: float = 0.5
    """What an edge at right angles to the contour counts as squared distance, in squared outlier distances."""
    model_to_image: float = 0.5
    """Weight of the model-to-image residuals; 0 leaves them out."""
    image_to_model: float = 0.5
    """Weight of the image-to-model residuals; 0 leaves them out."""
    edges: float = 1.0
    """Weight of the edges among the points of the image; 0 leaves them out."""
    silhouette: float = 0.5
    """The same of the silhouette's contour, where its view is fully trusted."""
    information_per_px: float = 0.0125
    """What one pixel of contour tells: 1 / (variance in px^2 times the length over which errors are alike, px)."""


class PartCosts(NamedTuple):
    """How well the contours of the parts fit, for people and for the judgement of a pose."""

    length_px: Array
    """Visible contour within the images, (V, n_parts), working px."""
    forward_px: Array
    """Mean distance of it to the edges, outliers cut off, (V, n_parts), working px; NaN where nothing is visible."""
    points: Array
    """Points of edges and silhouette that the part explains, (V, n_parts)."""
    silhouette: Array
    """Share of the silhouette's contour that some part explains, (V,); NaN in views without a silhouette."""


class Workspace(NamedTuple):
    """Room for the sums of a pose; what shares it must be used one at a time."""

    Ts: Array
    """Poses of all parts, (P, 4, 4)."""
    scratch: Scratch
    sums: Sums


class ContourResiduals:
    """The residuals of one person's contours against the edges of all views: a block for `gauss_newton.solve`.

    The others stand where they are; they hide, and draw the edges that are nearer to them.
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
        """Prepare the evidence for the kernel.

        Args:
            views: the evidence of each view.
            bodies: everybody in the scene, as predicted.
            person: index of the body that is fitted.
            settings: how to match.
            theta_px: outlier distance, px of the footage; by default that of each view.
            everywhere: keep edge points however far from the predicted contours they are, for poses far from it.
            contours: the predicted contours of everybody in each view; traced here by default.
        """
        settings = settings or MatchSettings()
        self._model = bodies[person].model
        self._own = parts_of([b.model for b in bodies], person)
        thetas = [v.outlier_px(theta_px) for v in views]
        near: Sequence[occluding_contours.Contour | None] = [None] * len(views)
        if not everywhere:
            near = contours or [occluding_contours.trace(bodies, v.camera) for v in views]
        points = [
            points_to_match(v, contour, _CAPTURE * theta, settings.edges, settings.silhouette)
            for v, contour, theta in zip(views, near, thetas, strict=True)
        ]
        sorted_points = [sort_points(p, v.camera.size) for p, v in zip(points, views, strict=True)]
        self._n_silhouette_points = np.array(
            [0 if v.silhouette is None else len(v.silhouette.points_px) for v in views]
        )
        weights = settings.information_per_px * np.array([settings.model_to_image, settings.image_to_model])
        arrays = ViewArrays(
            np.stack([v.camera.projection for v in views]),
            np.stack([v.camera.center_world for v in views]),
            np.array([v.camera.size for v in views], dtype=np.int64),
            np.concatenate([v.distance.ravel() for v in views]),
            np.ascontiguousarray(np.concatenate([s.points for s in sorted_points], axis=1)),
            np.cumsum([0] + [s.points.shape[1] for s in sorted_points]),
            stack_rows([s.rows for s in sorted_points]),
            np.array(thetas),
            # A view without any edge has nothing to say; its distance image is flat.
            np.array([weights if len(v.points_px) else 0 * weights for v in views]),
        )
        widest = max((v.camera for v in views), key=lambda camera: camera.width)
        self._max_pieces = occluding_contours.contour_room(widest, len(bodies))
        surfaces, Ts, own = (
            occluding_contours.surfaces_of(tuple(b.model for b in bodies)),
            occluding_contours.part_poses(bodies),
            self._own,
        )
        self._term = ContourTerm(
            Ts, own.start, own.stop, surfaces, arrays, settings.scale, settings.turn,
            self._static_buffer(np.arange(own.start, own.stop), len(Ts), arrays),
            scratch_buffer(surfaces, self._max_pieces, arrays.points.shape[1]), _sums_buffer(len(Ts), len(views)),
        )  # fmt: skip

    def _static_buffer(self, parts: IntArray, n_parts: int, arrays: ViewArrays) -> StaticContours:
        moves = np.zeros(n_parts, np.bool_)
        moves[parts] = True
        return static_contours_buffer(len(arrays.sizes), self._max_pieces, arrays.points.shape[1], moves)

    @property
    def workspace(self) -> Workspace:
        """The room that this works in."""
        return Workspace(self._term.Ts, self._term.scratch, self._term.sums)

    def restricted_to(self, parts: IntArray, workspace: Workspace) -> "ContourResiduals":
        """The same, quicker, for poses that differ in some parts of the person alone.

        It speaks for and against these parts only: what pulls at the others counts as cost, and is left out of the
        derivatives. Poses in which the others move too are as right, and slower.

        Args:
            parts: indices of the parts that move, (n,).
            workspace: room to work in, such as that of this one if the two are used one at a time.
        """
        out, term = copy(self), self._term
        static = self._static_buffer(self._own.start + parts, len(term.Ts), term.views)
        out._term = term._replace(static=static, **workspace._asdict())
        return out

    def clone_for_thread(self) -> "ContourResiduals":
        """The same for another thread: the evidence is shared, the room to work in is not."""
        out, term = copy(self), self._term
        moving, n_points = np.flatnonzero(term.static.moves), term.views.points.shape[1]
        out._term = term._replace(
            Ts=term.Ts.copy(),
            static=self._static_buffer(moving, len(term.Ts), term.views),
            scratch=scratch_buffer(term.surfaces, self._max_pieces, n_points),
            sums=_sums_buffer(len(term.Ts), len(term.views.sizes)),
        )
        return out

    def term(self, model: BodyModel) -> ContourTerm:
        """What the kernel needs to match the person, whose model is given."""
        assert model is self._model
        return self._term

    def linearize(self, model: BodyModel, values: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        term, own = self.term(model), self._own
        cost = self._accumulate(kinematics)
        gradient, hessian = np.empty(model.n_dofs), np.empty((model.n_dofs, model.n_dofs))
        twists_to_dofs(
            term.sums.M[own], term.sums.b[own], kinematics.axes_world, kinematics.origins_world, model.dof_is_length,
            model.dof_joint, model.tree.parents, model.moves, gradient, hessian,
        )  # fmt: skip
        return NormalEquations(cost, gradient, hessian)

    def costs(self, candidates: Array) -> Array:
        """Costs alone of many poses, (C, n_values) to (C,)."""
        out, model = np.empty(len(candidates)), self._model
        _score(np.ascontiguousarray(candidates, np.float64), model.tree, model.n_dofs, self._term, out)
        return out

    def part_costs(self, values: Array) -> PartCosts:
        """How well each part of the person fits, at a pose."""
        self._accumulate(self._model.kinematics(values), with_jacobian=False)
        sums = self._term.sums
        length, distance, points = np.moveaxis(sums.parts[:, self._own], -1, 0).copy()
        forward = np.divide(distance, length, out=np.full_like(length, np.nan), where=length > 0)
        total = self._n_silhouette_points
        silhouette = np.divide(sums.silhouette, total, out=np.full(len(total), np.nan), where=total > 0)
        return PartCosts(length, forward, points, silhouette)

    def _accumulate(self, kinematics: Kinematics, with_jacobian: bool = True) -> float:
        self._term.Ts[self._own] = kinematics.Ts_world_part
        return accumulate_normal_equations(self._term, with_jacobian)


def _sums_buffer(n_parts: int, n_views: int) -> Sums:
    """Uninitialized room for what the kernel adds up."""
    return Sums(
        np.empty((n_parts, 6, 6)), np.empty((n_parts, 6)), np.empty((n_views, n_parts, 3)), np.empty(n_views)
    )  # fmt: skip


@njit(nogil=True, cache=True)
def _score(candidates: Array, tree: Tree, n_dofs: int, term: ContourTerm, out: Array) -> None:
    """Fill the costs of poses, (C, n_values), of the person who is matched, (C,)."""
    axes, origins = np.empty((n_dofs, 3)), np.empty((n_dofs, 3))
    for c in range(candidates.shape[0]):
        forward_kinematics(candidates[c], tree, term.Ts[term.first : term.last], axes, origins)
        out[c] = accumulate_normal_equations(term, COST_ONLY)
