"""Shapes of several bodies as arrays, for the kernels that trace contours."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.shapes import Profile, Shape, TaperedSuperquadric

N_RINGS, N_SECTORS = 14, 24
"""Cells of the grid on a part that is no solid of revolution."""
PROFILE_TOLERANCE_M = 8e-4
"""Largest distance of a profile's chords from it, metres: 0.1 px where a person fills 640x480."""
N_SECTION, N_ALONG = 32, 128
"""Cells of the tables of a shape's cross-section and of its size along the axis."""
SECTION = 8
"""Offset of the cross-section table in the numbers of a solid. Before it are: 1/g_x, 1/g_y, k and b of the enclosing
quadric (see `shapes.Enclosure`); 1 if the quadric is the solid; the tapers k_x and k_y of a superquadric; 1 for a solid
of revolution."""
ALONG = SECTION + N_SECTION + 1
"""Offset of the table of size along the axis."""
SOLID = ALONG + N_ALONG + 1
"""Count of the numbers of a solid."""


class Surfaces(NamedTuple):
    """Shapes of several bodies. Parts are counted through all bodies; unit coordinates are those of `shapes`."""

    half_axes: Array
    """Half-axes of each shape, (P, 3), metres."""
    centers: Array
    """Centre of each shape in the part's frame, (P, 3), metres."""
    radii: Array
    """Bounding radius around the centre, (P,), metres."""
    profile_sizes: NDArray[np.int64]
    """Number of points of each part's profile, (P,); 0 if the part is no solid of revolution."""
    profiles: FloatArray
    """Radius, height, slope of the normal and its outward component at the points of each profile, (P, 4, n)."""
    grids: FloatArray
    """Grid of surface points in unit coordinates, ring by ring, (P, 3, rings * sectors)."""
    normals: FloatArray
    """Outward unit normals at these points times the half-axes, (P, 3, rings * sectors), metres."""
    offsets: FloatArray
    """Dot product of unit normal and point, (P, rings * sectors), metres."""
    solids: FloatArray
    """Numbers of each shape for `visibility`, (P, `SOLID`)."""
    adjoining: NDArray[np.bool_]
    """Whether two parts share a joint, (P, P)."""
    people: NDArray[np.int64]
    """Index of the body of each part, (P,)."""


_OF_SHAPES = ("profiles", "half_axes", "centers", "radii", "profile_sizes", "grids", "normals", "offsets", "solids")
"""Arrays that have a row for each shape and do not depend on the others, the one of varying width first."""


@lru_cache(maxsize=32)
def surfaces_of(models: tuple[BodyModel, ...]) -> Surfaces:
    """Return the arrays of the shapes of some bodies; cached, because models are immutable."""
    shapes = [s for m in models for s in m.shapes]
    centers = np.concatenate([m.centers_part for m in models])
    return _surfaces(models, shapes, centers, [s.profile(PROFILE_TOLERANCE_M) for s in shapes])


def resized_surfaces(
    models: tuple[BodyModel, ...], similar: Surfaces, changed: Sequence[int] | None = None
) -> Surfaces:
    """Return the arrays of the shapes of some bodies; quicker than `surfaces_of` where many sizes are tried.

    Args:
        models: the bodies.
        similar: arrays of the same bodies at other sizes. Profiles are sampled at the same heights, which fits sizes
            that do not differ much.
        changed: indices of the parts, counted through all bodies, whose shapes differ from those of `similar`; None
            stands for all.
    """
    shapes = [s for m in models for s in m.shapes]
    profiles: list[Profile | None] = []
    at = list(range(len(shapes)) if changed is None else changed)
    for i in at:
        shape = shapes[i]
        n = int(similar.profile_sizes[i])
        if n and isinstance(shape, TaperedSuperquadric):
            profiles.append(shape.profile_at(similar.profiles[i, 1, 1 : n - 1].astype(np.float64)))
        else:
            profiles.append(shape.profile(PROFILE_TOLERANCE_M))
    centers = np.concatenate([m.centers_part for m in models])
    if changed is None:
        return _surfaces(models, shapes, centers, profiles)
    own = _surfaces(models, [shapes[i] for i in at], centers[at], profiles)
    out = similar._replace(**{name: getattr(similar, name).copy() for name in _OF_SHAPES})
    out.profiles[at] = 0
    out.profiles[at, :, : own.profiles.shape[2]] = own.profiles
    for name in _OF_SHAPES[1:]:
        getattr(out, name)[at] = getattr(own, name)
    return out


def _surfaces(
    models: tuple[BodyModel, ...], shapes: Sequence[Shape], centers: Array, profiles: Sequence[Profile | None]
) -> Surfaces:
    """Return the arrays of some shapes around their centres, (P, 3), metres."""
    half_axes = np.array([s.half_axes for s in shapes])
    profile_sizes = np.array([0 if p is None else len(p.radii) for p in profiles])
    table = np.zeros((len(shapes), 4, profile_sizes.max()), np.float32)
    for i, p in enumerate(profiles):
        if p is not None:
            table[i, :, : len(p.radii)] = p.radii, p.heights, p.along / p.outward, p.outward
    points, normals = _grids(shapes)
    return Surfaces(
        half_axes,
        centers,
        np.linalg.norm(points, axis=1).max(axis=-1),
        profile_sizes,
        table,
        np.asarray(points / half_axes[..., None], np.float32),
        np.asarray(normals * half_axes[..., None], np.float32),
        np.sum(points * normals, axis=1).astype(np.float32),
        np.stack([_solid(s) for s in shapes]),
        _adjoining(models),
        np.repeat(np.arange(len(models)), [len(m.parts) for m in models]),
    )


def _grids(shapes: Sequence[Shape]) -> tuple[Array, Array]:
    """Return points and normals of the grids of shapes, (P, 3, rings * sectors) each, in rows that kernels read as
    vectors."""
    half_axes = np.array([s.half_axes for s in shapes])[..., None]
    points, normals = (np.stack(g) for g in zip(*map(_unit_grid, shapes), strict=True))
    normals /= half_axes
    return points * half_axes, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _unit_grid(shape: Shape) -> tuple[Array, Array]:
    """Return those of a shape with unit half-axes."""
    return _closed_grid(replace(shape, half_axes=(1.0, 1.0, 1.0)))


@lru_cache(maxsize=256)
def _closed_grid(shape: Shape) -> tuple[Array, Array]:
    """Return points and normals of a shape's grid, (3, rings * sectors), with flat ends beyond the first and last
    ring; cached, because sizes change without the form."""
    points, normals = shape.grid(N_RINGS, N_SECTORS)
    points = np.concatenate([points[:1], points, points[-1:]])
    normals = np.concatenate([np.zeros_like(normals[:1]), normals, np.zeros_like(normals[:1])])
    normals[0, :, 2], normals[-1, :, 2] = -1.0, 1.0
    return np.ascontiguousarray(points.reshape(-1, 3).T), np.ascontiguousarray(normals.reshape(-1, 3).T)


def _solid(shape: Shape) -> FloatArray:
    """Return the numbers of a solid, (SOLID,).

    The section through a point is larger than its larger coordinate by the factor `(1 + m^p)^(1/p)`, p = 2/e2,
    tabulated over the ratio m of the smaller coordinate to the larger. At height z, `(1 - |z|^(2/e1))^(e1/2)` of the
    widest section remains, tabulated over |z| from 0 to 1.
    """
    around = shape.enclosure
    (e1, e2), tapers = ((1.0, 1.0), (0.0, 0.0))
    if isinstance(shape, TaperedSuperquadric):
        (e1, e2), tapers = shape.exponents, shape.taper
    quadric = (1 / around.girths[0], 1 / around.girths[1], around.taper, around.bulge, around.exact)
    return np.array([*quadric, *tapers, e2 == 1.0 and tapers[0] == tapers[1], *_tables(e1, e2)], np.float32)


@lru_cache(maxsize=256)
def _tables(e1: float, e2: float) -> Array:
    """Return the section and then the table along the axis of a solid of some exponents; cached, as sizes change
    without them."""
    section = (1 + np.linspace(0, 1, N_SECTION + 1) ** (2 / e2)) ** (e2 / 2)
    return np.concatenate([section, (1 - np.linspace(0, 1, N_ALONG + 1) ** (2 / e1)) ** (e1 / 2)])


def _adjoining(models: tuple[BodyModel, ...]) -> NDArray[np.bool_]:
    n_parts, first = sum(len(m.parts) for m in models), 0
    adjoining = np.zeros((n_parts, n_parts), dtype=bool)
    for m in models:
        for part, parent in enumerate(m.parents):
            if parent >= 0:
                adjoining[first + part, first + parent] = adjoining[first + parent, first + part] = True
        first += len(m.parts)
    return adjoining
