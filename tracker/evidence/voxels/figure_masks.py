"""The silhouette of one figure of a visual hull in each view, where several people and strangers may be seen."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera

STRAY = 0.02
"""Share of a figure, or of its silhouette, that is no part of it: hair, rims and stray voxels. Others may cover as much
in a view in which they stand apart."""
_MARGIN = 1.0
"""Margin around projected voxels, in voxels: limbs that a view has lost are not in the hull."""


class FigureMask(NamedTuple):
    """The silhouette of one figure in one view."""

    mask: Mask
    """(H, W), raw pixels at working scale."""
    is_apart: bool
    """Whether no other figure covers it. A covered outline is not that of the figure alone."""

    @property
    def shows_figure_alone(self) -> bool:
        """Whether the view shows the figure, and no other one in front of it."""
        return self.is_apart and bool(self.mask.any())


def paint(points: Array, size_m: float, silhouette: ViewSilhouette, margin: float = 0.0) -> Mask:
    """Return the pixels of a view, (H, W), within squares of the size of a voxel around projected surface voxels.

    Squares of a hull's surface cover the inside too, because the far and the near side are projected.

    Args:
        points: centres of surface voxels, (N, 3), metres.
        size_m: edge of a voxel, metres.
        silhouette: of the view.
        margin: by which the squares are larger on each side, in voxels.
    """
    camera, mask = silhouette.camera, silhouette.mask
    depths = camera.depths(points)
    near = depths > size_m
    painted = np.zeros(mask.shape, np.uint8)
    if not near.any():
        return painted.view(bool)
    px = camera.project(points[near])
    half = int(np.ceil((0.5 + margin) * size_m * _px_per_m(camera, points[near], depths[near]))) + 1
    inside = (px >= 0).all(axis=1) & (px <= np.array(camera.size) - 1).all(axis=1)
    columns, rows = np.round(px[inside]).astype(int).T
    painted[rows, columns] = 1
    painted = np.asarray(cv2.dilate(painted, np.ones((2 * half + 1, 2 * half + 1), np.uint8)), np.uint8)
    return painted.view(bool)


def _px_per_m(camera: Camera, points: Array, depths: Array) -> float:
    """Return the scale of a view, px per metre, at the middle of points, (N, 3), of known depths, (N,), metres."""
    if not camera.fisheye:
        return float(camera.K[0, 0]) / float(np.median(depths))
    # Across the radius, where an equidistant lens enlarges more than along it.
    distances = np.linalg.norm(points - camera.center_world, axis=1)
    angles = np.arccos(np.clip(depths / distances, -1.0, 1.0))
    return float(camera.K[0, 0] * np.median(1 / (np.sinc(angles / np.pi) * distances)))


def figure_masks(
    silhouettes: Sequence[ViewSilhouette], figure: Voxels, others: Sequence[Voxels] = ()
) -> tuple[FigureMask, ...]:
    """Return the silhouette of a figure in each view.

    Args:
        silhouettes: of all views.
        figure: voxels of the figure.
        others: voxels of the other figures.
    """
    found = []
    for silhouette in silhouettes:
        mask = silhouette.mask & _painted(figure, silhouette, _MARGIN)
        covered = np.zeros_like(mask)
        for other in others:
            covered |= _painted(other, silhouette, _MARGIN)
        n = np.count_nonzero(mask)
        found.append(FigureMask(mask, bool(np.count_nonzero(mask & covered) <= STRAY * n)))
    return tuple(found)


def needed_figures(silhouettes: Sequence[ViewSilhouette], figures: Sequence[Voxels], least: float) -> list[Voxels]:
    """Return the figures that the silhouettes need; the others lie where lines of sight to several people meet.

    Args:
        silhouettes: of all views.
        figures: of a visual hull, the largest first.
        least: smallest share of a figure's silhouette, in one view at least, that no other figure covers.
    """
    kept = [[_painted(f, s, 0.0) & s.mask for s in silhouettes] for f in figures]
    indices = list(range(len(figures)))
    for i in reversed(range(len(figures))):
        others = [kept[j] for j in indices if j != i]
        if others and max(_own_share(own, [o[v] for o in others]) for v, own in enumerate(kept[i])) < least:
            indices.remove(i)
    return [figures[i] for i in indices]


def _own_share(own: Mask, others: Sequence[Mask]) -> float:
    """Return the share of a mask that no other mask covers."""
    alone = own & ~np.any(others, axis=0)
    return int(np.count_nonzero(alone)) / max(1, int(np.count_nonzero(own)))


def _painted(figure: Voxels, silhouette: ViewSilhouette, margin: float) -> Mask:
    surface = figure.grid.centers(figure.indices[figure.is_surface])
    return paint(surface, figure.grid.size_m, silhouette, margin)
