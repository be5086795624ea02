"""Carve the voxels around predicted figures, and leave out views that contradict the others."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.voxel.state import FilterState
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.carving import Carver
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M
from tracker.geometry.shapes import AXIS_SHARE

_REACH_M = 0.35
"""Distance from the prediction to which voxels are carved, metres: how far a limb may be from where it is predicted."""
AXIS = AXIS_SHARE * np.linspace(-1, 1, 9)
"""Places along the axis of a part that are looked up, in half sizes."""
_MIN_SHARE, _MIN_OTHERS = 0.4, 0.7
"""A view whose silhouette holds less of the figures than the first, while that of the second best holds more than the
second, contradicts the others."""


class FrameVoxels(NamedTuple):
    """The voxels of a frame around all people."""

    voxels: Voxels
    broken: tuple[str, ...]
    """Names of the views that were left out."""
    cut_off: tuple[str, ...]
    """Names of the views whose image ends within the people."""
    n_views: int
    """Number of views that show anybody and agree."""


def carve_around(silhouettes: Sequence[ViewSilhouette], states: Sequence[FilterState], size_m: float) -> FrameVoxels:
    """Carve the voxels of a frame within reach of some predicted figures.

    Views with an empty silhouette are left out, as are views that contradict the others. With fewer than two views
    there are no voxels.

    Args:
        silhouettes: of all views.
        states: predicted figures of all people.
        size_m: edge of a voxel, metres.
    """
    axes = np.concatenate([axis_points(s, AXIS).reshape(-1, 3) for s in states])
    seen = [s for s in silhouettes if not s.is_empty]
    shares = np.array([_share_inside(s, axes) for s in seen])
    good = shares >= _MIN_SHARE
    if not good.all() and np.sort(shares)[-2:-1].max(initial=0.0) < _MIN_OTHERS:
        good[:] = True  # the figures may have moved, rather than a camera
    used = [s for s, g in zip(seen, good, strict=True) if g]
    low, high = axes.min(axis=0) - _REACH_M, axes.max(axis=0) + _REACH_M
    grid = VoxelGrid.over(low, high, size_m)
    voxels = Voxels(grid, np.zeros(grid.shape, dtype=bool)) if len(used) < 2 else Carver(used).carve(grid)
    broken = tuple(s.camera.name for s, g in zip(seen, good, strict=True) if not g)
    return FrameVoxels(voxels, broken, tuple(s.camera.name for s in used if _is_cut_off(s)), len(used))


def axis_points(state: FilterState, at: Array) -> Array:
    """Return points on the axes of all parts, (10, n, 3), metres.

    Args:
        state: the figure.
        at: places along the axes, (n,), in half sizes.
    """
    z = at[None, :, None] * state.sizes[:, 2, None, None]
    return np.asarray(state.centers[:, None] + z * state.rotations[:, None, :, 2])


def occupied_at(voxels: Voxels, points: Array) -> NDArray[np.bool_]:
    """Return whether points, (..., 3), lie in occupied voxels, (...)."""
    at = np.round((points - voxels.grid.origin) / voxels.grid.size_m).astype(np.int64)
    inside = np.all((at >= 0) & (at < voxels.grid.shape), axis=-1)
    at = np.where(inside[..., None], at, 0)
    return np.asarray(voxels.occupied[at[..., 0], at[..., 1], at[..., 2]] & inside)


def occupied_near(voxels: Voxels, points: Array) -> NDArray[np.bool_]:
    """Return whether points, (..., 3), lie in occupied voxels or beside their faces, (...)."""
    steps = voxels.grid.size_m * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    return np.asarray(occupied_at(voxels, points[..., None, :] + steps).any(axis=-1))


def _share_inside(silhouette: ViewSilhouette, points: Array) -> float:
    """Return the share of points, (N, 3), in the silhouette; of those in the image. 1 if none is in the image."""
    camera = silhouette.camera
    near = camera.depths(points) > NEAR_PLANE_M
    px = np.round(np.nan_to_num(camera.project(points[near]), nan=-1.0)).astype(np.int64)
    px = px[np.all((px >= 0) & (px < camera.size), axis=1)]
    return float(silhouette.mask[px[:, 1], px[:, 0]].mean()) if len(px) else 1.0


def _is_cut_off(silhouette: ViewSilhouette) -> bool:
    mask = silhouette.mask
    return bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
