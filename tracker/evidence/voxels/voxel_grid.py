"""A regular grid of voxels, and the voxels of it that are occupied."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.geometry.arrays import Array, IntArray

VOXEL_M = 0.025
"""Edge of a voxel in which a person is found and measured, metres; errors of starts in docs/decisions/first_poses.md
are of this one."""
MAX_VOXELS = 400_000_000
"""Largest number of voxels of a grid: 400 MB."""


class VoxelGrid(NamedTuple):
    """A box of cubes, with edges along the axes of the world."""

    origin: Array
    """Centre of the first voxel, (3,), metres."""
    size_m: float
    """Edge of a voxel, metres."""
    shape: tuple[int, int, int]
    """Number of voxels along x, y, z."""

    @classmethod
    def over(cls, low: Array, high: Array, size_m: float) -> "VoxelGrid":
        """Return the grid whose voxels fill a box, (3,) each, metres. Centres lie at multiples of the voxel size.

        Raises:
            TrackerError: the size is not positive, or there would be too many voxels.
        """
        if not size_m > 0:
            raise TrackerError(f"expected a positive voxel size, found {1000 * size_m:g} mm; 25 to 50 mm are usual")
        first = np.floor(low / size_m + 0.5)
        counts = np.maximum(np.ceil(high / size_m - 0.5) - first + 1, 1)
        if counts.prod() > MAX_VOXELS:
            raise TrackerError(
                f"expected at most {MAX_VOXELS // 10**6} million voxels, found {counts.prod() / 10**6:.0f} million of "
                f"{1000 * size_m:g} mm; use larger voxels"
            )
        return cls(first * size_m, size_m, (int(counts[0]), int(counts[1]), int(counts[2])))

    def centers(self, indices: IntArray) -> Array:
        """Return the centres of voxels by index, (N, 3), in the world, (N, 3), metres."""
        return self.origin + self.size_m * np.asarray(indices, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Voxels:
    """The occupied voxels of a grid."""

    grid: VoxelGrid
    occupied: NDArray[np.bool_]
    """(nx, ny, nz)."""

    @cached_property
    def indices(self) -> IntArray:
        """Indices of the occupied voxels, (N, 3)."""
        return np.argwhere(self.occupied)

    @cached_property
    def points_world(self) -> Array:
        """Centres of the occupied voxels, (N, 3), metres."""
        return self.grid.centers(self.indices)

    @cached_property
    def is_surface(self) -> NDArray[np.bool_]:
        """Whether each occupied voxel has an empty neighbour across a face, or lies at the grid's border, (N,)."""
        padded = np.pad(self.occupied, 1)
        inner = padded.copy()
        for axis in range(3):
            inner &= np.roll(padded, 1, axis) & np.roll(padded, -1, axis)
        x, y, z = self.indices.T + 1
        return ~inner[x, y, z]

    def without(self, left_out: NDArray[np.bool_]) -> "Voxels":
        """Return the voxels without some of them, (N,)."""
        occupied = self.occupied.copy()
        occupied[tuple(self.indices[left_out].T)] = False
        return Voxels(self.grid, occupied)

    def scaled(self, factor: float) -> "Voxels":
        """Return the figure larger by a factor about the world's origin."""
        origin, size_m, shape = self.grid
        return Voxels(VoxelGrid(origin * factor, size_m * factor, shape), self.occupied)

    @property
    def volume_m3(self) -> float:
        """Volume of the occupied voxels, cubic metres."""
        return float(np.count_nonzero(self.occupied)) * self.grid.size_m**3

    def cropped(self) -> "Voxels":
        """Return the same voxels in the smallest grid; unchanged if there are none."""
        if not len(self.indices):
            return self
        low, high = self.indices.min(axis=0), self.indices.max(axis=0) + 1
        box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
        occupied = np.ascontiguousarray(self.occupied[box])
        nx, ny, nz = occupied.shape
        return Voxels(VoxelGrid(self.grid.centers(low), self.grid.size_m, (nx, ny, nz)), occupied)

    def components(self, min_share: float = 0.0) -> "list[Voxels]":
        """Return the connected components (26 neighbours), the largest first.

        Args:
            min_share: smallest size of a component, as a share of the largest one.
        """
        from scipy.ndimage import label  # imported lazily: loading scipy takes 0.2 s

        labels, n = label(self.occupied, structure=np.ones((3, 3, 3)))
        counts = np.bincount(labels.ravel(), minlength=n + 1)[1:]
        order = [i for i in np.argsort(-counts) if counts[i] >= min_share * counts.max()]
        return [Voxels(self.grid, labels == i + 1) for i in order]
