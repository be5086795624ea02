"""Carve the voxels that agree with the silhouettes of a frame (MTHC01 Sect. 2).

Look up raw pixels from undistorted sensor coordinates, so that only the rigid motion is computed at run time.

MTHC01 Eq. 1 maps distorted to undistorted coordinates (Tsai). Cameras here have OpenCV's model, which maps undistorted
to distorted ones, so that the table is filled without inverting it. The table depends on the lens alone and holds for
any pose of the camera.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.threads import N_HELPERS, map_chunked
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.carving_kernels import STACK_COLUMNS, ViewTables, carve_blocks
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.arrays import Array, FloatArray, IntArray
from tracker.geometry.cameras import BEYOND_PX, Camera
from tracker.geometry.lens_tables import Lens, lens_of

_STEPS_PER_PX = 2
"""Entries of the table per raw pixel along each axis."""
_MAX_ENTRIES = 4096
"""Largest number of entries along each axis. Wide lenses have long borders."""
_BORDER_SAMPLES = 64
"""Points along each side of the image whose rays bound the table; a border bends little between two of them."""
_ROWS_AT_ONCE = 64
"""Rows of the table that are filled at a time: all rows of a wide lens would take gigabytes."""


class SensorLookup(NamedTuple):
    """Raw pixel of each quantized point of the undistorted sensor plane at focal length 1."""

    pixels: NDArray[np.int16]
    """Column and row of the raw pixel, (rows, columns, 2). It may lie outside the image."""
    corner: Array
    """Sensor coordinates x, y of the first entry, (2,)."""
    step: float
    """Distance between entries along both axes."""
    px_per_unit: float
    """Upper bound of the distance of two entries' pixels along an image axis, divided by their distance."""


@lru_cache(maxsize=32)
def lookup_of_lens(lens: Lens) -> SensorLookup:
    """Return the table of all cameras with a lens, cached. It covers the image and half a pixel around it."""
    camera = lens.camera
    low, high = _border(camera)
    step = max(1 / (_STEPS_PER_PX * max(camera.K[0, 0], camera.K[1, 1])), float((high - low).max()) / _MAX_ENTRIES)
    n_columns, n_rows = (int(np.ceil(n)) + 1 for n in (high - low) / step)
    x, rows = low[0] + step * np.arange(n_columns), low[1] + step * np.arange(n_rows)
    exact = np.concatenate([_exact_pixels(camera, x, y) for y in np.array_split(rows, -(-n_rows // _ROWS_AT_ONCE))])
    pixels = np.round(np.clip(exact, BEYOND_PX, -BEYOND_PX)).astype(np.int16)
    return SensorLookup(pixels, low, step, _steepest(exact) / step)


def _exact_pixels(camera: Camera, x: Array, y: Array) -> Array:
    """Return the raw pixel of each point of a grid of sensor coordinates, (len(y), len(x), 2)."""
    points = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1).reshape(-1, 3)
    exact = camera.project(points)
    # Beyond the lens the polynomial bends back: nothing is seen there.
    exact[~camera.within_lens(camera.pinhole.project(points)) | np.isnan(exact).any(axis=-1)] = BEYOND_PX
    return exact.reshape(len(y), len(x), 2)


def _border(camera: Camera) -> tuple[Array, Array]:
    """Return the lowest and highest sensor coordinates of the image, (2,) each; of a fisheye's, as undistorted."""
    seen = camera.pinhole if camera.fisheye else camera
    width, height = seen.size
    u, v = np.linspace(-1, width, _BORDER_SAMPLES), np.linspace(-1, height, _BORDER_SAMPLES)
    sides = [np.stack(np.broadcast_arrays(a, b), axis=-1) for a, b in ((u, -1), (u, height), (-1, v), (width, v))]
    rays = seen.rays(np.concatenate(sides))
    xy = rays[:, :2] / rays[:, 2:]
    return xy.min(axis=0), xy.max(axis=0)


def _steepest(pixels: Array) -> float:
    """Return the largest change of a pixel coordinate per step of the table, for a step in any direction of a box."""
    valid = np.asarray((pixels > BEYOND_PX).all(axis=-1), dtype=bool)
    along_x = np.abs(np.diff(pixels, axis=1))[valid[:, 1:] & valid[:, :-1]].max(axis=0)
    along_y = np.abs(np.diff(pixels, axis=0))[valid[1:] & valid[:-1]].max(axis=0)
    return float((along_x + along_y).max())


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
