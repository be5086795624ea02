"""The shapes of several bodies as arrays, for the kernels that trace contours."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.shapes import Shape, TaperedSuperquadric

N_RINGS, N_SECTORS = 14, 24
"""Of the grid on a part that is no solid of revolution."""
PROFILE_TOLERANCE_M = 8e-4
"""How far the chords of a profile may stray from it, metres: a tenth of a pixel where a person fills 640x480."""
N_SECTION, N_ALONG = 32, 128
"""Cells of the tables of a shape's cross-section and of its size along the axis."""
SECTION = 8
"""Where the table of the cross-section begins among the numbers of a solid. Before it: 1/g_x, 1/g_y, k and b of the
quadric around it (see `shapes.Enclosure`), 1 if that is the solid itself, the tapers k_x, k_y of a superquadric, and
1 if it is a solid of revolution."""
ALONG = SECTION + N_SECTION + 1
"""Where the table of its size along the axis begins."""
SOLID = ALONG + N_ALONG + 1


class Surfaces(NamedTuple):
    """The shapes of several bodies. Parts are counted through all bodies; unit coordinates are those of `shapes`."""

    half_axes: Array
    """Half-axes of each shape, (P, 3), metres."""
    centers: Array
    """Centre of each shape in the part's frame, (P, 3), metres."""
    radii: Array
    """Bounding radius around the centre, (P,), metres."""
    profile_sizes: NDArray[np.int64]
    """Number of points of each part's profile, 0 for no solid of revolution, (P,)."""
    profiles: FloatArray
    """Radius, height, and the normal's slope and outward component at the points of each profile, (P, 4, n)."""
    grids: FloatArray
    """Grid of surface points in unit coordinates, ring by ring, (P, 3, rings * sectors)."""
    normals: FloatArray
    """Their outward unit normals times the half-axes, (P, 3, rings * sectors), metres."""
    offsets: FloatArray
    """Unit normal times point, (P, rings * sectors), metres."""
    solids: FloatArray
    """What `hiding` asks of each shape, (P, `SOLID` numbers)."""
    adjoining: NDArray[np.bool_]
    """Whether two parts share a joint, (P, P)."""
    people: NDArray[np.int64]
    """Index of the body of each part, (P,)."""


@lru_cache(maxsize=32)
def surfaces_of(models: tuple[BodyModel, ...]) -> Surfaces:
    """Arrays of the shapes of the given bodies; kept, because models are immutable."""
    shapes = [s for m in models for s in m.shapes]
    half_axes = np.array([s.half_axes for s in shapes])
    profiles = [s.profile(PROFILE_TOLERANCE_M) for s in shapes]
    profile_sizes = np.array([0 if p is None else len(p.radii) for p in profiles])
    table = np.zeros((len(shapes), 4, profile_sizes.max()), np.float32)
    for i, p in enumerate(profiles):
        if p is not None:
            table[i, :, : len(p.radii)] = p.radii, p.heights, p.along / p.outward, p.outward
    points, normals = (np.stack(g) for g in zip(*(_closed_grid(s) for s in shapes), strict=True))
    return Surfaces(
        half_axes,
        np.concatenate([m.centers_part for m in models]),
        np.linalg.norm(points, axis=1).max(axis=-1),
        profile_sizes,
        table,
        # Row by row, which kernels read as whole vectors; as they are stacked they stand point by point.
        np.ascontiguousarray(points / half_axes[..., None], np.float32),
        np.ascontiguousarray(normals * half_axes[..., None], np.float32),
        np.sum(points * normals, axis=1).astype(np.float32),
        np.stack([_solid(s) for s in shapes]),
        _adjoining(models),
        np.repeat(np.arange(len(models)), [len(m.parts) for m in models]),
    )


def _closed_grid(shape: Shape) -> tuple[Array, Array]:
    """Points and normals of a shape's grid, (3, rings * sectors), with a flat end beyond its first and last ring."""
    points, normals = shape.grid(N_RINGS, N_SECTORS)
    points = np.concatenate([points[:1], points, points[-1:]])
    normals = np.concatenate([np.zeros_like(normals[:1]), normals, np.zeros_like(normals[:1])])
    normals[0, :, 2], normals[-1, :, 2] = -1.0, 1.0
    return points.reshape(-1, 3).T, normals.reshape(-1, 3).T


def _solid(shape: Shape) -> FloatArray:
    """The numbers of a solid, (SOLID,).

    The section through a point is larger than its larger coordinate by `(1 + m^p)^(1/p)`, p = 2/e2, tabulated over
    the ratio m of the smaller one to it; at z, `(1 - |z|^(2/e1))^(e1/2)` of the widest section is left, tabulated over
    |z| from 0 to 1.
    """
    around = shape.enclosure
    (e1, e2), tapers = ((1.0, 1.0), (0.0, 0.0))
    if isinstance(shape, TaperedSuperquadric):
        (e1, e2), tapers = shape.exponents, shape.taper
    section = (1 + np.linspace(0, 1, N_SECTION + 1) ** (2 / e2)) ** (e2 / 2)
    along = (1 - np.linspace(0, 1, N_ALONG + 1) ** (2 / e1)) ** (e1 / 2)
    quadric = (1 / around.girths[0], 1 / around.girths[1], around.taper, around.bulge, around.exact)
    return np.array([*quadric, *tapers, e2 == 1.0 and tapers[0] == tapers[1], *section, *along], np.float32)


def _adjoining(models: tuple[BodyModel, ...]) -> NDArray[np.bool_]:
    n_parts, first = sum(len(m.parts) for m in models), 0
    adjoining = np.zeros((n_parts, n_parts), dtype=bool)
    for m in models:
        for part, parent in enumerate(m.parents):
            if parent >= 0:
                adjoining[first + part, first + parent] = adjoining[first + parent, first + part] = True
        first += len(m.parts)
    return adjoining
