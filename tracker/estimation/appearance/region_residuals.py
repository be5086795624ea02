"""Region evidence as a residual block: its derivative by a pose is an integral along contours.

The evidence for a body is a sum over the cells that its parts cover. A part whose contour moves outwards gains its
evidence for the cells that it enters, and the part behind it loses its own. Integrated along the visible contours, this
is the derivative of the sum (S. C. Zhu, A. Yuille 1996, IEEE PAMI 18:884). At a right contour the difference falls from
inside to outside, and its slope is the second derivative.

The cost counts whole cells, so that it is rougher than its derivative: a cell is a quarter of an independent sample.

Kernels of the derivative of region evidence: along the contours of parts, and over the cells that they cover.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody, ahead, parts_of
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.appearance.part_drawing import CELL_PX, Canvas, CellView, draw, meshes_of
from tracker.estimation.appearance.region_kernels import RegionTables, add_score, ratio_bin
from tracker.estimation.appearance.region_model import RegionFrame, RegionModel, sample_share
from tracker.estimation.fitting.clocked_residuals import SummedBlocks, at_time
from tracker.estimation.fitting.contour_arrays import Scratch, scratch_buffer
from tracker.estimation.fitting.contour_residuals import equations_of_twists
from tracker.estimation.fitting.gauss_newton import NormalEquations, ResidualBlock
from tracker.estimation.fitting.segment_matching import pack_visible
from tracker.estimation.fitting.twists import add_twists
from tracker.evidence.contours.occluding_contours import contour_room, part_poses, trace_pieces
from tracker.evidence.contours.pieces import PIECE_PX, place_parts
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.evidence.images.color_histogram import bin_of
from tracker.geometry.arrays import Array, FloatArray, Image

_PIECE_CELLS = PIECE_PX / CELL_PX
"""Longest piece of contour, cells."""


class _View(NamedTuple):
    """A view of the frame."""

    cells: CellView
    background: FloatArray
    """Log density of the colour of each cell as background, (h, w)."""
    tables: RegionTables
    """Of the view."""
    share: float
    """See `sample_share`."""
    scratch: Scratch
    """For the pieces of its contours."""


@dataclass(frozen=True, eq=False)
class _RegionResiduals:
    """Region evidence for one person in views of one time; see `ResidualBlock`. One thread at a time may use it."""

    views: Sequence[_View]
    bodies: Sequence[PosedBody]
    """All people at that time; the person may be in any pose."""
    person: int
    """Index of the person."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`. The cost is the negative evidence for all people, nats."""
        own = parts_of([b.model for b in self.bodies], self.person)
        Ts = part_poses(self.bodies)
        Ts[own] = kinematics.Ts_world_part
        M, b = np.zeros((len(Ts), 6, 6)), np.zeros((len(Ts), 6))
        nats = sum(self._add(view, Ts, own, M, b) for view in self.views)
        return equations_of_twists(model, kinematics, -nats, M[own], b[own])

    def _add(self, view: _View, Ts: Array, own: slice, M: Array, b: Array) -> float:
        """Add the normal equations of the person's parts in a view; return the evidence for all parts, nats."""
        camera, scratch, models = view.cells.camera, view.scratch, tuple(x.model for x in self.bodies)
        P, eye, surfaces = camera.projection, camera.center_world, surfaces_of(models)
        canvas = draw(meshes_of(models), P, Ts, *view.cells.colors.shape[:2])
        place = view.cells.colors, canvas, view.share, view.background, view.tables
        nats, samples = np.zeros((2, len(Ts)))
        add_score(*place, nats, samples)
        place_parts(Ts, surfaces, scratch.traced)
        trace_pieces(P, eye, surfaces, _PIECE_CELLS, scratch.traced)
        pack_visible(len(Ts), scratch)
        scratch.pulls[:, : scratch.firsts[-1]] = 0.0
        add_region_pulls(own.start, own.stop, *place, P, scratch)
        for part in range(own.start, own.stop):
            span, W = scratch.firsts[part : part + 2], scratch.traced.Ts_world_unit[part]
            add_twists(span, scratch.pieces, scratch.pulls, P, W, eye, False, M[part], b[part])
        add_depth_forces(own.start, own.stop, *place, eye, np.linalg.inv(P[:, :3]), P[2, :3], b)
        return float(nats.sum())


def region_residuals(known: RegionModel, frame: RegionFrame, bodies: Sequence[PosedBody], person: int) -> ResidualBlock:
    """Return the region evidence of a frame for a person, each view at the time of its picture.

    Args:
        known: the appearance of all people.
        frame: the frame.
        bodies: all people; the others stay.
        person: index of the person.
    """
    surfaces, blocks = surfaces_of(tuple(b.model for b in bodies)), list[ResidualBlock]()
    shown = [(i, v) for i, v in enumerate(frame.views) if v is not None]
    for time in sorted({v.ahead_frames for _, v in shown}):
        views = []
        for i, v in shown:
            if v.ahead_frames == time:
                room = contour_room([v.camera], len(bodies), _PIECE_CELLS)
                scratch = scratch_buffer(surfaces, room, 0)
                views.append(_View(v, frame.background[i], known.by_view[i], sample_share(v.camera), scratch))
        own = _RegionResiduals(views, ahead(bodies, time), person)
        blocks.append(at_time(own, bodies[person].velocity, time))
    return SummedBlocks(blocks)


@njit(**NO_REFCOUNT)
def add_region_pulls(
    first: int, last: int, colors: Image, canvas: Canvas, share: float, background: FloatArray, tables: RegionTables,
    P: Array, scratch: Scratch,
) -> None:  # fmt: skip
    """Add to the pulls across the visible pieces of some parts, and turn their normals outwards.

    A line is fitted to the evidence for the part, less that for what is behind it, in three cells across each piece:
    the fewest that show a slope. The value at the contour is the gain of a movement outwards, the slope its change.

    Args:
        first: index of the first part.
        last: index after the last part.
        colors: of the cells, (h, w, 3) RGB.
        canvas: all parts in the view.
        share: see `region_kernels`.
        background: log density of the colour of each cell as background, (h, w).
        tables: of the view.
        P: projection matrix to cells, (3, 4).
        scratch: visible pieces of all parts, and their pulls.
    """
    nearness, labels = canvas
    height, width = labels.shape
    q, pulls, W = scratch.pieces, scratch.pulls, scratch.traced.Ts_world_unit
    for part in range(first, last):
        middle_u, middle_v, _ = _projected(P, W[part], 0.0, 0.0, 0.0)
        for k in range(scratch.firsts[part], scratch.firsts[part + 1]):
            u, v, nu, nv = q[0, k], q[1, k], q[3, k], q[4, k]
            if nu * (u - middle_u) + nv * (v - middle_v) < 0.0:  # parts are convex
                nu, nv = -nu, -nv
            q[3, k], q[4, k] = nu, nv
            outer_u, outer_v = round(u + nu), round(v + nv)
            if not (0 <= outer_u < width and 0 <= outer_v < height):
                continue
            behind = np.int64(labels[outer_v, outer_u]) - 1
            _, _, depth = _projected(P, W[part], q[5, k], q[6, k], q[7, k])
            if behind == part or nearness[outer_v, outer_u] * depth > 1.0:
                continue  # the part goes on there, or another one hides it
            own_share, share_behind = share * depth**2, 0.0
            if behind >= 0:
                share_behind = share / nearness[outer_v, outer_u] ** 2
            total, slope, n, squares = 0.0, 0.0, 0, 0
            for s in (-1, 0, 1):
                at_u, at_v = round(u + s * nu), round(v + s * nv)
                if not (0 <= at_u < width and 0 <= at_v < height):
                    continue
                color, known = bin_of(colors, at_v, at_u), background[at_v, at_u]
                gain = own_share * tables.trust[part, ratio_bin(tables, part, color, known)]
                if behind >= 0:
                    gain -= share_behind * tables.trust[behind, ratio_bin(tables, behind, color, known)]
                total, slope, n, squares = total + gain, slope + s * gain, n + 1, squares + s * s
            pulls[0, k] += q[2, k] * max(-slope / squares, 0.0)
            pulls[1, k] -= q[2, k] * total / n


@njit(**NO_REFCOUNT)
def _projected(P: Array, T: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return column, row and depth of a point of a part, moved to the world by T, (3, 4)."""
    X = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
    Y = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
    Z = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
    depth = P[2, 0] * X + P[2, 1] * Y + P[2, 2] * Z + P[2, 3]
    u = (P[0, 0] * X + P[0, 1] * Y + P[0, 2] * Z + P[0, 3]) / depth
    v = (P[1, 0] * X + P[1, 1] * Y + P[1, 2] * Z + P[1, 3]) / depth
    return u, v, depth


@njit(**NO_REFCOUNT)
def add_depth_forces(
    first: int, last: int, colors: Image, canvas: Canvas, share: float, background: FloatArray, tables: RegionTables,
    eye: Array, rays: Array, row: Array, b: Array,
) -> None:  # fmt: skip
    """Add to the gradients of the twists of some parts, (P, 6): farther away, a cell is larger on the body.

    Args:
        first: see `add_region_pulls`, as the next six.
        last: see there.
        colors: see there.
        canvas: see there.
        share: see there.
        background: see there.
        tables: see there.
        eye: camera centre in the world, (3,), metres.
        rays: from homogeneous cells to directions of depth 1 in the world, (3, 3).
        row: derivative of the depth by a point of the world, (3,).
        b: gradients, added to.
    """
    nearness, labels = canvas
    for v in range(labels.shape[0]):
        for u in range(labels.shape[1]):
            p = np.int64(labels[v, u]) - 1
            if p < first or p >= last:
                continue
            depth = 1.0 / nearness[v, u]
            trust = tables.trust[p, ratio_bin(tables, p, bin_of(colors, v, u), background[v, u])]
            force = -2.0 * share * depth * trust
            x = eye[0] + depth * (rays[0, 0] * u + rays[0, 1] * v + rays[0, 2])
            y = eye[1] + depth * (rays[1, 0] * u + rays[1, 1] * v + rays[1, 2])
            z = eye[2] + depth * (rays[2, 0] * u + rays[2, 1] * v + rays[2, 2])
            fx, fy, fz = force * row[0], force * row[1], force * row[2]
            b[p, 0] += y * fz - z * fy
            b[p, 1] += z * fx - x * fz
            b[p, 2] += x * fy - y * fx
            b[p, 3] += fx
            b[p, 4] += fy
            b[p, 5] += fz
