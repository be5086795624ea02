"""Part shapes: tapered superquadrics (GD96 Sect. 3), truncated elliptical cones (KRH08 Sect. 3) and ellipsoids.

A shape has its own frame: z along its axis, half-axes along x, y, z. *Unit coordinates* are divided by the half-axes,
so that the solid is about as large as the unit ball. In them cones, ellipsoids and superquadrics with an elliptic
cross-section are solids of revolution, determined by their profile.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array

_N_RINGS, _N_SECTORS = 24, 32
"""Latitudes and longitudes of a mesh."""
AXIS_SHARE = 0.8
"""Share of a half-axis up to which points on the axis of a part stand for it: beyond, they may lie in the next part."""
_FLAT = 1e-6
"""Component away from the axis of the normal of a flat end: almost 0, so that its slope is finite."""


class Triangles(NamedTuple):
    """A triangle mesh."""

    vertices: Array
    """(N, 3), metres."""
    faces: NDArray[np.int64]
    """Indices of the corners of each triangle, counter-clockwise seen from outside, (M, 3)."""


class Profile(NamedTuple):
    """The profile of a solid of revolution in unit coordinates, from its -z to its +z end.

    The first and last point are flat ends: a disc that meets the surface in a rim.
    """

    radii: Array
    """Distance from the axis, (n,)."""
    heights: Array
    """Position along the axis, (n,)."""
    outward: Array
    """The normal's component away from the axis, (n,)."""
    along: Array
    """The normal's component along z, (n,)."""


class Enclosure(NamedTuple):
    """A quadric around a solid in unit coordinates: `(x/g_x)^2 + (y/g_y)^2 + b z^2 <= (1 + k z)^2` with |z| <= 1."""

    girths: tuple[float, float]
    """g_x, g_y."""
    taper: float
    """k."""
    bulge: float
    """b."""
    exact: bool
    """Whether the quadric is the solid itself."""


@dataclass(frozen=True)
class TaperedSuperquadric:
    """The solid `(|x/(a1 s_x)|^(2/e2) + |y/(a2 s_y)|^(2/e2))^(e2/e1) + |z/a3|^(2/e1) <= 1`.

    The taper is `s_x = 1 + k_x z/a3`, `s_y = 1 + k_y z/a3` (after Metaxas & Terzopoulos 1993). With exponents in
    (0, 1] the solid is convex for the mild tapers of body parts.
    """

    half_axes: tuple[float, float, float]
    """a1, a2, a3: half-axes along x, y, z, metres."""
    exponents: tuple[float, float]
    """e1 along the axis, e2 around it; 1 is an ellipse, towards 0 a rectangle."""
    taper: tuple[float, float] = (0.0, 0.0)
    """k_x, k_y: relative change of the x and y half-axis from z = 0 to z = a3; within (-1, 1)."""

    @property
    def degree(self) -> float:
        """The degree with which `inside_outside` grows with the distance from the centre."""
        return 2 / self.exponents[0]

    def inside_outside(self, points: Array) -> Array:
        """Evaluate the solid's implicit function at points `(..., 3)` in its frame: below 1 inside."""
        (a1, a2, a3), (e1, e2), (kx, ky) = self.half_axes, self.exponents, self.taper
        # Outside the slab |z| <= a3 the taper could become negative; such points are outside anyway.
        zn = points[..., 2] / a3
        zc = np.clip(zn, -1.0, 1.0)
        x = np.abs(points[..., 0] / (a1 * (1 + kx * zc)))
        y = np.abs(points[..., 1] / (a2 * (1 + ky * zc)))
        return (x ** (2 / e2) + y ** (2 / e2)) ** (e2 / e1) + np.abs(zn) ** (2 / e1)

    def surface(self, eta: Array, omega: Array) -> tuple[Array, Array]:
        """Return points and outward unit normals `(..., 3)` at latitudes `eta` in [-pi/2, pi/2], longitudes `omega`."""
        (a1, a2, a3), (e1, e2), (kx, ky) = self.half_axes, self.exponents, self.taper
        ce, se = _signed_power(np.cos(eta), e1), _signed_power(np.sin(eta), e1)
        co, so = _signed_power(np.cos(omega), e2), _signed_power(np.sin(omega), e2)
        z = se
        sx, sy = 1 + kx * z, 1 + ky * z
        points = np.stack([a1 * sx * ce * co, a2 * sy * ce * so, np.broadcast_to(a3 * z, (ce * co).shape)], -1)
        # Normal of the untapered solid, transformed by the inverse transpose of the taper's Jacobian.
        nx = _signed_power(np.cos(eta), 2 - e1) * _signed_power(np.cos(omega), 2 - e2) / a1
        ny = _signed_power(np.cos(eta), 2 - e1) * _signed_power(np.sin(omega), 2 - e2) / a2
        nz = _signed_power(np.sin(eta), 2 - e1) / a3 * np.ones_like(nx)
        x, y = a1 * ce * co, a2 * ce * so
        normals = np.stack([nx / sx, ny / sy, nz - (kx * x * nx / sx + ky * y * ny / sy) / a3], -1)
        return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    def grid(self, n_rings: int, n_sectors: int) -> tuple[Array, Array]:
        """Return points and normals `(n_rings, n_sectors, 3)` on closed rings from the -z to the +z end.

        The first and last ring lie close to the poles, where the normals point along the axis. Rings and sectors
        are spread so that the normal turns evenly: bends get more of them than straight sides.
        """
        eta = np.linspace(-np.pi / 2, np.pi / 2, n_rings + 2)[1:-1]
        omega = np.arange(n_sectors, dtype=np.float64) * (2 * np.pi / n_sectors) + np.pi / n_sectors
        return self.surface(*np.meshgrid(eta, omega, indexing="ij", sparse=True))

    def triangles(self, n_rings: int = _N_RINGS, n_sectors: int = _N_SECTORS) -> Triangles:
        """Return a closed surface in the shape's frame."""
        return _closed(self.grid(n_rings, n_sectors)[0], self.half_axes[2])

    @cached_property
    def girth_bound(self) -> float:
        """Factor by which an elliptic cross-section must grow to enclose the superelliptic one."""
        return float(2 ** ((1 - self.exponents[1]) / 2))

    def profile(self, tolerance_m: float) -> Profile | None:
        """Return the profile in unit coordinates, thinned within a tolerance; None if not a solid of revolution."""
        if self.exponents[1] != 1.0 or self.taper[0] != self.taper[1]:
            return None
        return _superquadric_profile(self, tolerance_m)

    def profile_at(self, heights: Array) -> Profile:
        """Return the profile of a solid of revolution at given heights within (-1, 1), (n,), in unit coordinates."""
        return _profile_at(self.exponents[0], self.taper[0], tuple(heights.tolist()))

    @property
    def enclosure(self) -> Enclosure:
        """Return a cone around the solid, or a cylinder if the taper differs along x and y."""
        (kx, ky), g = self.taper, self.girth_bound
        if kx == ky:
            return Enclosure((g, g), kx, 0.0, False)
        return Enclosure((g * (1 + abs(kx)), g * (1 + abs(ky))), 0.0, 0.0, False)


@dataclass(frozen=True)
class EllipticalCone:
    """A truncated elliptical cone, or cylinder, between flat ends (KRH08 Eq. 3).

    The solid `(x/a1)^2 + (y/a2)^2 <= (1 + k z/a3)^2` with `|z| <= a3`.
    """

    half_axes: tuple[float, float, float]
    """a1, a2, a3: half-axes of the ellipse midway, along x and y, and half the length along z, metres."""
    taper: float = 0.0
    """k: relative change of the ellipse from z = 0 to z = a3; within (-1, 1), 0 is a cylinder."""
    degree: ClassVar[float] = 2.0

    def inside_outside(self, points: Array) -> Array:
        """Evaluate the solid's implicit function at points `(..., 3)` in its frame: below 1 inside."""
        x, y, z = np.moveaxis(points / self.half_axes, -1, 0)
        return np.maximum((x**2 + y**2) / (1 + self.taper * np.clip(z, -1.0, 1.0)) ** 2, z**2)

    def grid(self, n_rings: int, n_sectors: int) -> tuple[Array, Array]:
        """Return points and normals `(n_rings, n_sectors, 3)` on closed rings from the -z to the +z end, with ends."""
        k, n_end = self.taper, max(1, n_rings // 5)
        inner = (np.arange(n_end) + 0.5) / n_end
        side = np.linspace(-1.0, 1.0, n_rings - 2 * n_end)
        radii = np.concatenate([inner * (1 - k), 1 + k * side, inner[::-1] * (1 + k)])
        heights = np.concatenate([-np.ones(n_end), side, np.ones(n_end)])
        away = np.concatenate([np.zeros(n_end), np.ones(len(side)), np.zeros(n_end)])
        along = np.concatenate([-np.ones(n_end), np.full(len(side), -k), np.ones(n_end)])
        omega = np.arange(n_sectors, dtype=np.float64) * (2 * np.pi / n_sectors) + np.pi / n_sectors

        def turned(radius: Array, height: Array) -> Array:
            x, y = np.outer(radius, np.cos(omega)), np.outer(radius, np.sin(omega))
            return np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1)

        normals = turned(away, along) / self.half_axes
        return turned(radii, heights) * self.half_axes, normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    def triangles(self, n_rings: int = _N_RINGS, n_sectors: int = _N_SECTORS) -> Triangles:
        """Return a closed surface in the shape's frame."""
        return _closed(self.grid(n_rings, n_sectors)[0], self.half_axes[2])

    def profile(self, tolerance_m: float) -> Profile:
        """Return the profile in unit coordinates: two points of one slope, which give two straight rulings."""
        k = self.taper
        return _with_ends(np.array([1 - k, 1 + k]), np.array([-1.0, 1.0]), np.ones(2), np.full(2, -k))

    @property
    def enclosure(self) -> Enclosure:
        """Return the cone itself."""
        return Enclosure((1.0, 1.0), self.taper, 0.0, True)


@dataclass(frozen=True)
class Ellipsoid:
    """The solid `(x/a1)^2 + (y/a2)^2 + (z/a3)^2 <= 1`."""

    half_axes: tuple[float, float, float]
    """a1, a2, a3: half-axes along x, y, z, metres."""
    degree: ClassVar[float] = 2.0

    def inside_outside(self, points: Array) -> Array:
        """Evaluate the solid's implicit function at points `(..., 3)` in its frame: below 1 inside."""
        return np.sum((points / self.half_axes) ** 2, axis=-1)

    def grid(self, n_rings: int, n_sectors: int) -> tuple[Array, Array]:
        """Return points and normals `(n_rings, n_sectors, 3)` on closed rings from the -z to the +z end."""
        return self._superquadric.grid(n_rings, n_sectors)

    def triangles(self, n_rings: int = _N_RINGS, n_sectors: int = _N_SECTORS) -> Triangles:
        """Return a closed surface in the shape's frame."""
        return self._superquadric.triangles(n_rings, n_sectors)

    def profile(self, tolerance_m: float) -> Profile | None:
        """Return the profile in unit coordinates, thinned to chords within a tolerance."""
        return self._superquadric.profile(tolerance_m)

    @property
    def enclosure(self) -> Enclosure:
        """Return the ellipsoid itself."""
        return Enclosure((1.0, 1.0), 0.0, 1.0, True)

    @property
    def _superquadric(self) -> TaperedSuperquadric:
        return TaperedSuperquadric(self.half_axes, (1.0, 1.0))


Shape = TaperedSuperquadric | EllipticalCone | Ellipsoid


@lru_cache(maxsize=1024)
def _superquadric_profile(shape: TaperedSuperquadric, tolerance_m: float) -> Profile:
    """Return the profile of a superquadric of revolution; cached, because a change of one part leaves the others."""
    (a1, a2, a3), e1, k = shape.half_axes, shape.exponents[0], shape.taper[0]
    eta = np.linspace(-np.pi / 2, np.pi / 2, 401)[1:-1]
    z, r = _signed_power(np.sin(eta), e1), np.cos(eta) ** e1
    return _profile(e1, k, eta[_chords(np.stack([max(a1, a2) * r * (1 + k * z), a3 * z], axis=1), tolerance_m)])


@lru_cache(maxsize=1024)
def _profile_at(e1: float, k: float, heights: tuple[float, ...]) -> Profile:
    """Return the profile of a superquadric of revolution at some heights; cached, because it is that of all sizes."""
    sine = _signed_power(np.array(heights), 1 / e1)  # of the latitude
    return _profile(e1, k, np.arcsin(np.clip(sine, -1.0, 1.0)))


def _profile(e1: float, k: float, eta: Array) -> Profile:
    """Return the profile of a superquadric of revolution with exponent e1 and taper k at latitudes, (n,)."""
    z, r = _signed_power(np.sin(eta), e1), np.cos(eta) ** e1
    s = 1 + k * z
    away = np.cos(eta) ** (2 - e1) / s
    return _with_ends(r * s, z, away, _signed_power(np.sin(eta), 2 - e1) - k * np.cos(eta) ** 2 / s)


def _signed_power(base: Array, exponent: float) -> Array:
    return np.sign(base) * np.abs(base) ** exponent


def _with_ends(radii: Array, heights: Array, outward: Array, along: Array) -> Profile:
    """Close a profile by flat ends, and normalize its normals."""
    norms = np.hypot(outward, along)
    return Profile(
        np.concatenate([radii[:1], radii, radii[-1:]]),
        np.concatenate([heights[:1], heights, heights[-1:]]),
        np.concatenate([[_FLAT], outward / norms, [_FLAT]]),
        np.concatenate([[-1.0], along / norms, [1.0]]),
    )


def _chords(curve: Array, tolerance: float) -> list[int]:
    """Thin a curve (n, 2) to chords that deviate from it by at most the tolerance; return the indices of their ends."""
    selected, last = [0], 1
    while selected[-1] < len(curve) - 1:
        while last + 1 < len(curve):
            chord = curve[last + 1] - curve[selected[-1]]
            between = curve[selected[-1] + 1 : last + 1] - curve[selected[-1]]
            off = np.abs(chord[0] * between[:, 1] - chord[1] * between[:, 0])
            if off.max() > tolerance * np.hypot(*chord):
                break
            last += 1
        selected.append(last)
        last += 1
    return selected


def _closed(rings: Array, end: float) -> Triangles:
    """Build the surface through closed rings of points (n_rings, n_sectors, 3) with a pole at z = -end and z = end."""
    n_rings, n_sectors, _ = rings.shape
    vertices = np.concatenate([rings.reshape(-1, 3), [[0.0, 0.0, -end], [0.0, 0.0, end]]])
    ring, sector = np.meshgrid(np.arange(n_rings - 1), np.arange(n_sectors), indexing="ij")
    a, b = ring * n_sectors + sector, ring * n_sectors + (sector + 1) % n_sectors
    quads = np.stack([a, b, b + n_sectors, a + n_sectors], axis=-1).reshape(-1, 4)
    first = np.arange(n_sectors)
    last = (n_rings - 1) * n_sectors + first
    bottom, top = n_rings * n_sectors, n_rings * n_sectors + 1
    faces = np.concatenate(
        [
            quads[:, [0, 1, 2]],
            quads[:, [0, 2, 3]],
            np.stack([np.full(n_sectors, bottom), np.roll(first, -1), first], axis=-1),
            np.stack([np.full(n_sectors, top), last, np.roll(last, -1)], axis=-1),
        ]
    )
    return Triangles(vertices, faces)
