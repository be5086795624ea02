"""Recover the parts of people that background subtraction classifies as shadows, by comparing views.

Clothes that are a darker shade of what is behind them look like its shadow (Horprasert, Harwood & Davis 1999). A shadow
on the floor is one in every view. Behind clothes, other views see the floor as it was, or the person.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.evidence.images.background_subtraction import clean_silhouette, dilate, without_rims
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.bounding_volume import bounding_volume
from tracker.evidence.voxels.carving import Carver, CarveSettings
from tracker.evidence.voxels.figure_masks import paint
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane

_TOLERANCE = 0.01
"""Distance up to which a change counts as the same place, as a fraction of the longer side of the image: shadows have
soft borders, and floors are not quite flat."""
_ABOVE_M = 0.1
"""Height above the floor from which voxels count, metres: near the feet, shadows lie within the other views' hull."""
_MIN_SHARE = 0.2
"""Smallest part that is recovered by the hull, as a share of the silhouette: about that of a leg. The hull of the other
views is thicker than the people, so that it covers some of their shadows too."""


def recover_from_shadows(
    silhouettes: Sequence[ViewSilhouette], floor: GroundPlane, size_m: float
) -> tuple[ViewSilhouette, ...]:
    """Return silhouettes with the parts of people that look like shadows.

    Args:
        silhouettes: of all views. Silhouettes without a shadow stay as they are.
        floor: the floor.
        size_m: edge of the voxels by which the views are compared, metres.
    """
    return _recover_hidden(recover_standing(silhouettes, floor), floor, size_m)


def recover_standing(silhouettes: Sequence[ViewSilhouette], floor: GroundPlane) -> tuple[ViewSilhouette, ...]:
    """Return silhouettes with those pixels of their shadows behind which other views see the floor unchanged.

    A pixel counts if more views see the floor there unchanged than in a shadow. Views in which somebody stands before
    that place, or that do not show it, do not count.

    Args:
        silhouettes: of all views. Silhouettes without a shadow stay as they are.
        floor: the floor.
    """
    shadows = [s.shadow for s in silhouettes]
    changed = [
        None if s.shadow is None else dilate(s.mask | s.shadow, _TOLERANCE * max(s.mask.shape)) for s in silhouettes
    ]
    found = []
    for i, own in enumerate(silhouettes):
        if own.shadow is None:
            found.append(own)
            continue
        rows, columns = np.nonzero(own.shadow)
        places, is_floor = _floor_behind(np.stack([columns, rows], axis=1).astype(np.float64), own.camera, floor)
        votes = np.zeros(len(rows))
        for j, (shadow, near) in enumerate(zip(shadows, changed, strict=True)):
            if j != i and shadow is not None and near is not None:
                (x, y), is_seen = _pixels(silhouettes[j].camera, places)
                votes[is_seen] += np.where(near[y, x], -1.0 * shadow[y, x], 1.0)
        standing = np.zeros_like(own.mask)
        standing[rows, columns] = is_floor & (votes > 0)
        mask = clean_silhouette(own.mask | without_rims(standing)).mask
        found.append(own._replace(mask=mask, shadow=own.shadow & ~mask))
    return tuple(found)


def is_changed_at(silhouette: ViewSilhouette, points: Array) -> NDArray[np.bool_]:
    """Return at which points a view shows a change, (N,), or nothing since they lie beside its image.

    Args:
        silhouette: of the view.
        points: (N, 3), metres.
    """
    (x, y), is_seen = _pixels(silhouette.camera, points)
    shown = silhouette.mask[y, x]
    found = np.ones(len(points), dtype=bool)
    found[is_seen] = shown if silhouette.shadow is None else shown | silhouette.shadow[y, x]
    return found


def _recover_hidden(
    silhouettes: Sequence[ViewSilhouette], floor: GroundPlane, size_m: float
) -> tuple[ViewSilhouette, ...]:
    """Return silhouettes with those of their shadows that the hull of all other views covers, where they are large."""
    changed = [s if s.shadow is None else s._replace(mask=s.mask | s.shadow) for s in silhouettes]
    try:
        box = bounding_volume(changed)
    except TrackerError:
        return tuple(silhouettes)  # carving them reports what is wrong
    grid = VoxelGrid.over(box.low, box.high, size_m)
    of_all, of_others = Carver(changed).carve(grid), Carver(silhouettes).carve(grid, CarveSettings(missing=1))
    people = Voxels(grid, of_all.occupied & of_others.occupied)
    surface = people.points_world[people.is_surface]
    surface = surface[surface @ floor.normal - floor.offset_m > _ABOVE_M]
    return tuple(_with_hidden(s, surface, size_m) for s in silhouettes)


def _with_hidden(silhouette: ViewSilhouette, surface: Array, size_m: float) -> ViewSilhouette:
    """Return a silhouette with the part of its shadow that a hull covers, if it is large."""
    if silhouette.shadow is None:
        return silhouette
    hidden = without_rims(silhouette.shadow & paint(surface, size_m, silhouette))
    if np.count_nonzero(hidden) <= _MIN_SHARE * np.count_nonzero(silhouette.mask):
        return silhouette
    return silhouette._replace(mask=silhouette.mask | hidden, shadow=silhouette.shadow & ~hidden)


def _floor_behind(points_px: Array, camera: Camera, floor: GroundPlane) -> tuple[Array, NDArray[np.bool_]]:
    """Return the places of the floor behind some pixels, (n, 3), metres, and which pixels have one."""
    rays = camera.rays(points_px)
    with np.errstate(divide="ignore"):
        distances = (floor.offset_m - camera.center_world @ floor.normal) / (rays @ floor.normal)
    is_floor = np.isfinite(distances) & (distances > 0)
    return camera.center_world + np.where(is_floor, distances, 0.0)[:, None] * rays, is_floor


def _pixels(camera: Camera, places: Array) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the columns and rows of the places that a view shows, (2, m), and which of them these are, (n,)."""
    px = camera.project(places)
    with np.errstate(invalid="ignore"):
        is_seen = np.all((px > -0.5) & (px < np.array(camera.size) - 0.5), axis=1)
    is_seen &= camera.within_lens(camera.pinhole.project(places))
    return np.round(px[is_seen]).astype(np.int64).T, is_seen
