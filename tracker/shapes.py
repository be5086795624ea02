"""Part shapes: the tapered superquadrics of GD96 Sect. 3 (after Metaxas & Terzopoulos 1993).

A shape lives in its own frame, z along its axis. Cylinders, cones, spheres, ellipsoids and boxes with rounded
edges are all members of the family.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh

from tracker.rigid import Array


@dataclass(frozen=True)
class TaperedSuperquadric:
    """The solid `(|x/(a1 s_x)|^(2/e2) + |y/(a2 s_y)|^(2/e2))^(e2/e1) + |z/a3|^(2/e1) <= 1`.

    The taper is `s_x = 1 + k_x z/a3`, `s_y = 1 + k_y z/a3`. With exponents in (0, 1] the solid is convex for the
    mild tapers of body parts.
    """

    half_axes: tuple[float, float, float]
    """a1, a2, a3: half-axes along x, y, z, metres."""
    exponents: tuple[float, float]
    """e1 along the axis, e2 around it; 1 is an ellipse, towards 0 a rectangle."""
    taper: tuple[float, float] = (0.0, 0.0)
    """k_x, k_y: relative change of the x and y half-axis from z = 0 to z = a3; within (-1, 1)."""

    def inside_outside(self, points: Array) -> Array:
        """Evaluate the solid's implicit function at points `(..., 3)` in its frame: below 1 inside."""
        (a1, a2, a3), (e1, e2), (kx, ky) = self.half_axes, self.exponents, self.taper
        # Outside the slab |z| <= a3 the taper could turn negative; there the point is outside anyway.
        zn = points[..., 2] / a3
        zc = np.clip(zn, -1.0, 1.0)
        x = np.abs(points[..., 0] / (a1 * (1 + kx * zc)))
        y = np.abs(points[..., 1] / (a2 * (1 + ky * zc)))
        return (x ** (2 / e2) + y ** (2 / e2)) ** (e2 / e1) + np.abs(zn) ** (2 / e1)

    def surface(self, eta: Array, omega: Array) -> tuple[Array, Array]:
        """Points and outward unit normals `(..., 3)` at latitudes `eta` in [-pi/2, pi/2], longitudes `omega`."""
        (a1, a2, a3), (e1, e2), (kx, ky) = self.half_axes, self.exponents, self.taper
        ce, se = _signed_power(np.cos(eta), e1), _signed_power(np.sin(eta), e1)
        co, so = _signed_power(np.cos(omega), e2), _signed_power(np.sin(omega), e2)
        z = se
        sx, sy = 1 + kx * z, 1 + ky * z
        points = np.stack([a1 * sx * ce * co, a2 * sy * ce * so, np.broadcast_to(a3 * z, (ce * co).shape)], -1)
        # Normal of the untapered solid, carried through the inverse transpose of the taper's Jacobian.
        nx = _signed_power(np.cos(eta), 2 - e1) * _signed_power(np.cos(omega), 2 - e2) / a1
        ny = _signed_power(np.cos(eta), 2 - e1) * _signed_power(np.sin(omega), 2 - e2) / a2
        nz = _signed_power(np.sin(eta), 2 - e1) / a3 * np.ones_like(nx)
        x, y = a1 * ce * co, a2 * ce * so
        normals = np.stack([nx / sx, ny / sy, nz - (kx * x * nx / sx + ky * y * ny / sy) / a3], -1)
        return points, normals / np.linalg.norm(normals, axis=-1, keepdims=True)

    def grid(self, n_rings: int, n_sectors: int) -> tuple[Array, Array]:
        """Points and normals `(n_rings, n_sectors, 3)` on closed rings from the -z to the +z end.

        The first and last ring lie close to the poles, where the normals point along the axis. Rings and sectors
        are spread so that the normal turns evenly: bends get more of them than straight sides.
        """
        eta = np.linspace(-np.pi / 2, np.pi / 2, n_rings + 2)[1:-1]
        omega = np.arange(n_sectors) * (2 * np.pi / n_sectors) + np.pi / n_sectors
        return self.surface(*np.meshgrid(eta, omega, indexing="ij"))

    def mesh(self, n_rings: int = 24, n_sectors: int = 32) -> trimesh.Trimesh:
        """Closed triangle mesh of the surface in the shape's frame."""
        points, _ = self.grid(n_rings, n_sectors)
        a3 = self.half_axes[2]
        vertices = np.concatenate([points.reshape(-1, 3), [[0.0, 0.0, -a3], [0.0, 0.0, a3]]])
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
        return trimesh.Trimesh(vertices, faces, process=False)

    @cached_property
    def girth_bound(self) -> float:
        """Factor by which an elliptic cross-section must grow to enclose the superelliptic one."""
        return float(2 ** ((1 - self.exponents[1]) / 2))


def _signed_power(base: Array, exponent: float) -> Array:
    return np.sign(base) * np.abs(base) ** exponent
