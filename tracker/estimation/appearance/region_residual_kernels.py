"""Kernels of the derivative of region evidence: along the contours of parts, and over the cells that they cover."""

import numpy as np

from tracker.compute.jit import njit
from tracker.compute.numba_options import NO_REFCOUNT
from tracker.estimation.appearance.part_drawing import Canvas
from tracker.estimation.appearance.region_kernels import RegionTables, ratio_bin
from tracker.estimation.fitting.contour_arrays import Scratch
from tracker.evidence.images.color_histogram import bin_of
from tracker.geometry.arrays import Array, FloatArray, Image


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
