"""Carve the voxels that agree with the silhouettes of a frame (MTHC01 Sect. 2)."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.threads import N_HELPERS, map_chunked
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.carving_kernels import STACK_COLUMNS, ViewTables, carve_blocks
from tracker.evidence.voxels.sensor_lookup import SensorLookup, lookup_of_lens
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.arrays import FloatArray, IntArray
from tracker.geometry.lens_tables import Lens, lens_of

_BLOCK = 16
"""Voxels along the edge of the largest blocks. For a room of 3 m and voxels of 25 mm, 69,200 blocks and voxels of 1.8
million are tested; with 8 along the edge 71,000, with 32 as many."""
_MIN_VOXELS_SHARED = 1_000_000
"""Grids with more voxels are carved by all threads; for smaller ones handing over takes longer."""


class CarveSettings(NamedTuple):
    """Which voxels agree with the silhouettes."""

    min_views: int = 2
    """Fewest views in whose silhouettes a voxel lies."""
    missing: int = 0
    """Most views that show a voxel outside of the silhouette, for views that are broken. Views that a voxel is out of
    the image of do not count."""


_ALL_AGREE = CarveSettings()
"""All views that a voxel is in the image of agree, at least two."""


class Carver:
    """The silhouettes of a frame, ready to carve any grid."""

    def __init__(self, silhouettes: Sequence[ViewSilhouette]) -> None:
        """Prepare tables; those of the lenses are computed once for each camera.

        Args:
            silhouettes: of all views, with the cameras of their raw pixels.
        """
        self.silhouettes = tuple(silhouettes)
        self._tables = _view_tables(silhouettes)

    def carve(self, grid: VoxelGrid, settings: CarveSettings = _ALL_AGREE) -> Voxels:
        """Return the voxels of a grid whose centres agree with the silhouettes, by dividing blocks."""
        return self._carve_blocks(grid, settings)[0]

    def _carve_blocks(self, grid: VoxelGrid, settings: CarveSettings) -> tuple[Voxels, int]:
        """Return the voxels, and the number of blocks and voxels that were tested."""
        occupied = np.zeros(grid.shape, dtype=bool)
        n_threads = N_HELPERS if occupied.size > _MIN_VOXELS_SHARED else 1
        stacks = [np.empty((7 * _BLOCK.bit_length() + 1, STACK_COLUMNS), np.int64) for _ in range(n_threads)]

        def part(stack: IntArray, i: int) -> int:
            return int(
                carve_blocks(
                    self._tables, grid.origin, grid.size_m, tuple(settings), _BLOCK, (i, n_threads), stack, occupied
                )
            )

        if n_threads == 1:
            return Voxels(grid, occupied), part(stacks[0], 0)
        return Voxels(grid, occupied), sum(map_chunked(part, stacks, range(n_threads)))


def _view_tables(silhouettes: Sequence[ViewSilhouette]) -> ViewTables:
    lookups = _joined_lookups(tuple(lens_of(s.camera) for s in silhouettes))
    sums, boxes = zip(*(_integral(s.mask) for s in silhouettes), strict=True)
    return ViewTables(
        np.stack([s.camera.T_camera_world[:3] for s in silhouettes]).astype(np.float32),
        *lookups,
        np.concatenate([s.ravel() for s in sums]),
        np.column_stack([_layout([s.shape for s in sums])[:, [0, 2]], np.array(boxes)]),
        np.array([s.camera.size for s in silhouettes], dtype=np.int64),
    )


@lru_cache(maxsize=4)  # joining megabytes takes longer than carving
def _joined_lookups(lenses: tuple[Lens, ...]) -> tuple[NDArray[np.int16], IntArray, FloatArray]:
    """Return the tables of several lenses one after the other, their layout and their scales; see `ViewTables`."""
    lookups = [lookup_of_lens(lens) for lens in lenses]
    pixels = np.concatenate([lookup.pixels.reshape(-1, 2) for lookup in lookups])
    return pixels, _layout([lookup.pixels.shape[:2] for lookup in lookups]), _scales(lookups)


def _layout(shapes: Sequence[tuple[int, ...]]) -> IntArray:
    """Return the first entry, rows and columns of arrays that are stored one after the other, (n, 3)."""
    ends = np.cumsum([rows * columns for rows, columns in shapes])
    return np.array([(end - r * c, r, c) for end, (r, c) in zip(ends, shapes, strict=True)], dtype=np.int64)


def _scales(lookups: Sequence[SensorLookup]) -> FloatArray:
    return np.array([(*t.corner, 1 / t.step, t.px_per_unit) for t in lookups], dtype=np.float32)


def _integral(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int32], tuple[int, int, int, int]]:
    """Return the integral image of a silhouette's box, and the box u0, v0, u1, v1."""
    if not mask.any():
        return np.zeros((1, 1), np.int32), (0, 0, 0, 0)
    u, v, width, height = cv2.boundingRect(mask.view(np.uint8))
    inside = np.ascontiguousarray(mask[v : v + height, u : u + width]).view(np.uint8)
    return np.asarray(cv2.integral(inside), np.int32), (u, v, u + width, v + height)
