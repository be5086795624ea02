"""Oracles of the compiled kernels of voxels: each voxel and view by itself."""

from unittest.mock import patch

import numpy as np

from tracker.estimation.voxel import labels
from tracker.evidence.voxels import carving


def carve_plainly(carver, grid, rule):
    """Which voxels `Carver.carve` must find: views are counted one by one, and no block is larger than a voxel."""
    n_inside, n_outside = (
        sum(_carved_alone(s._replace(mask=mask(s.mask)), grid).astype(int) for s in carver.silhouettes)
        for mask in (np.asarray, np.logical_not)
    )
    return (n_inside >= rule.min_views) & (n_outside <= rule.missing)


def project_plainly(silhouettes, points):
    """Which points (n, 3) all silhouettes hold, by projection, and which lie at the border of one."""
    inside, at_border = np.ones(len(points), bool), np.zeros(len(points), bool)
    for view in silhouettes:
        u, v = np.round(view.camera.project(points)).astype(int).T
        rows, columns = (
            np.clip(np.add(x, [[-1], [0], [1]]), 0, n - 1) for x, n in zip((v, u), view.mask.shape, strict=True)
        )
        around = view.mask[rows[:, None], columns]  # (3, 3, n)
        at_border |= np.any(around, axis=(0, 1)) & ~np.all(around, axis=(0, 1))
        inside &= around[1, 1] > 0
    return inside, at_border


def _carved_alone(silhouette, grid):
    with patch.object(carving, "_BLOCK", 1):
        return carving.Carver([silhouette]).carve(grid, carving.CarveSettings(min_views=1)).occupied


def label_voxels_plainly(points, states, size_m, rule):
    """What `label_voxels` must return, without a compiled kernel."""
    centers, rotations, (inverses, added) = labels._parts(states, size_m, rule.widened)
    local = np.einsum("mji,nmj->nmi", rotations, points[:, None] - centers)
    squared = np.einsum("nmi,mij,nmj->nm", local, inverses, local)
    distances = np.where(squared < rule.gate, squared + added, np.inf)
    found = distances.argmin(axis=1).astype(np.int16)
    found[~np.isfinite(distances.min(axis=1))] = labels.NO_PART
    moments = np.zeros((len(centers), labels.N_MOMENTS))
    for m in range(len(centers)):
        own = local[found == m, m]
        moments[m] = [len(own), *own.sum(axis=0), *(own.T @ own)[labels._UPPER]]
    return labels.Labels(found, labels._clouds(moments, size_m))
