"""The visual hull of the people in a frame: bounded, carved, separated into figures, and checked against the views."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.errors import TrackerError
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.bounding_volume import bounding_volume, pyramid
from tracker.evidence.voxels.carving import Carver
from tracker.evidence.voxels.figure_masks import needed_figures, paint
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.geometry.arrays import Array

MIN_FIGURE_M3 = 0.008
"""Smallest volume of a figure, cubic metres: a child of a year has 10 litres."""
_MIN_SHARE = 0.25
"""Smallest volume of a figure, as a share of the largest one."""
_MATTERS = 0.15
"""Share of silhouettes by which a figure or a view must matter: somewhat more than an arm. A figure explains so much of
one that no other does, because lines of sight to two people also meet where there is no person. A view is left out as
broken if without it so much more of the others is explained."""
_MIN_LEAD = 0.05
"""Lead of that gain over the gain without any other view."""
_MIN_COVERAGE = 0.6
"""Share of its silhouette that the hull explains in a view that agrees with the others."""
_NEARLY_ALL = 0.95
"""Share of its silhouette that the hull explains in a view that shows people alone, simulated (`test_visual_hull`)."""


class VisualHull(NamedTuple):
    """The voxels of all people of a frame."""

    figures: tuple[Voxels, ...]
    """Connected figures of the size of a person, the largest first."""
    coverages: Array
    """Share of each view's silhouette that the hull explains, (n_views,); NaN for an empty silhouette."""
    broken: tuple[str, ...]
    """Names of the views that were left out, because the others agree without them."""
    is_covered: bool = False
    """Whether that view shows a part of the people in their place, as behind furniture; else it may have moved."""

    @property
    def least_explained(self) -> int | None:
        """Index of the view whose silhouette the hull explains least; None if it explains nearly all of each."""
        least = int(np.nanargmin(self.coverages))
        return least if self.coverages[least] < _NEARLY_ALL else None


def carve_people(silhouettes: Sequence[ViewSilhouette], size_m: float) -> VisualHull:
    """Carve the people of a frame.

    A view that the others contradict is left out if at least two others remain.

    Args:
        silhouettes: of all views.
        size_m: edge of a voxel, metres.

    Raises:
        TrackerError: fewer than two views show people, the views contradict each other, or nothing of the size of a
            person is found.
    """
    seen = [s for s in silhouettes if not s.is_empty]
    voxels, found, broken = _carve_consistent(seen, size_m)
    names = [s.camera.name for s in seen]
    figures = (
        [v for v in voxels.components(_MIN_SHARE) if v.volume_m3 >= MIN_FIGURE_M3] if voxels.occupied.any() else []
    )
    figures = needed_figures(seen, figures, _MATTERS)
    if not figures:
        raise TrackerError(
            f"expected a figure of at least {1000 * MIN_FIGURE_M3:.0f} litres where the silhouettes meet, found "
            f"{_largest(voxels)}; check that no camera has moved, and the background"
        )
    poor = [f"{n} {100 * c:.0f}%" for n, c in zip(names, found, strict=True) if c < _MIN_COVERAGE]
    if len(poor) > (broken >= 0):
        raise TrackerError(
            f"expected silhouettes that agree, found some that the others hardly explain ({', '.join(poor)}); check "
            "that no camera has moved, that the videos start at the same time, and the background",
            camera=names[int(np.argmin(found))],
        )
    by_name = dict(zip(names, found, strict=True))
    of_views = np.array([by_name.get(s.camera.name, np.nan) for s in silhouettes])
    is_covered = broken >= 0 and bool(found[broken] >= _MIN_COVERAGE)
    left_out = (names[broken],) if broken >= 0 else ()
    return VisualHull(tuple(f.cropped() for f in figures), of_views, left_out, is_covered)


def coverages(voxels: Voxels, silhouettes: Sequence[ViewSilhouette]) -> Array:
    """Return the share of each view's silhouette that projected voxels cover, (n_views,)."""
    indices = voxels.indices[voxels.is_surface]
    return np.array([_coverage(voxels.grid.centers(indices), voxels.grid.size_m, s) for s in silhouettes])


def _carve(silhouettes: Sequence[ViewSilhouette], pyramids: Sequence[Array], size_m: float) -> Voxels:
    box = bounding_volume(silhouettes, pyramids)
    return Carver(silhouettes).carve(VoxelGrid.over(box.low, box.high, size_m))


def _carve_consistent(silhouettes: Sequence[ViewSilhouette], size_m: float) -> tuple[Voxels, Array, int]:
    """Carve all views, or all but the one without which the others agree much better.

    A view that is left out must stand out: where the others agree about as well without another view, none is.

    Returns:
        The voxels, each view's coverage, (n_views,), and the index of the view that was left out; -1 if none was.
    """
    whole: tuple[Voxels, Array] | None = None
    contradiction: TrackerError | None = None
    pyramids = [pyramid(s) for s in silhouettes]
    try:
        voxels = _carve(silhouettes, pyramids, size_m)
        whole = voxels, coverages(voxels, silhouettes)
    except TrackerError as error:
        contradiction = error
    n = len(silhouettes)
    before = whole[1] if whole else np.zeros(n)
    if n > 2 and before.min() < 1 - _MATTERS:
        without = [_without(i, silhouettes, pyramids, size_m) for i in range(n)]
        gains = [float(np.delete(w[1] - before, i).mean()) if w else 0.0 for i, w in enumerate(without)]
        best, second = (int(i) for i in np.argsort(gains)[:-3:-1])
        chosen = without[best]
        if chosen and gains[best] > _MATTERS and gains[best] - gains[second] > _MIN_LEAD:
            return *chosen, best
    if whole is None:
        raise contradiction or AssertionError
    return *whole, -1


def _without(
    left_out: int, silhouettes: Sequence[ViewSilhouette], pyramids: Sequence[Array], size_m: float
) -> tuple[Voxels, Array] | None:
    """Return the voxels of all views but one, and the coverages of all; None if the others contradict each other."""
    try:
        others = [i for i in range(len(silhouettes)) if i != left_out]
        voxels = _carve([silhouettes[i] for i in others], [pyramids[i] for i in others], size_m)
    except TrackerError:
        return None
    return voxels, coverages(voxels, silhouettes)


def _coverage(points: Array, size_m: float, silhouette: ViewSilhouette) -> float:
    """Return the share of a silhouette that projected surface voxels cover."""
    covered = paint(points, size_m, silhouette) & silhouette.mask
    return float(np.count_nonzero(covered) / np.count_nonzero(silhouette.mask))


def _largest(voxels: Voxels) -> str:
    """Describe the largest piece of a hull without a figure, for people to read."""
    if not voxels.occupied.any():
        return "none"
    litres = 1000 * max(v.volume_m3 for v in voxels.components(0.0))
    if litres < 1000 * MIN_FIGURE_M3:
        return f"pieces of at most {litres:.1f} litres"
    return "only pieces that the silhouettes do not need"
