"""Search the shape of each part by the chamfer distance in space, coarse to fine (GD96 Sect. 3).

Back-projected image contours are compared with the contour generators of the part. The distance is the undirected
normalized chamfer distance (GD96 Eq. 1-3) between points in space, averaged over the contours of the part. The poses
and the lengths stay, so that joints keep their places.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from tracker.body.model import ahead, parts_of
from tracker.estimation.acquisition.back_projection import MIN_POINTS, back_project_contours
from tracker.estimation.acquisition.size_fit import SightedPerson
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.surfaces import Surfaces, resized_surfaces, surfaces_of
from tracker.geometry.arrays import TINY, Array

_BLOCKS = (
    ("girth_a", "side_x", "taper_x"),
    ("girth_b", "side_y", "side_z", "taper_y"),
    ("free_end", "taper", "exponent_along"),
)
"""Parameters of a part that are searched together: those across it in one view, in the other, and along it. The
exponent around the part stays, because two orthogonal contours do not show it."""
_PIECE_PX = 1.0
"""Distance of the points of a contour generator, px: points farther apart would blur the distance of two contours."""


@dataclass(frozen=True)
class ChamferSearchSettings:
    """Settings of the search."""

    range_sigmas: float = GROSS_SIGMAS
    """Half the range of each parameter, in standard deviations of `SizePriors`; girths vary with the build too."""
    levels: int = 5
    """Number of step sizes, each half of the one before; the first is half of half the range."""
    passes: int = 2
    """Number of times that contours are assigned and all parts are searched; later passes begin a level finer."""
    outlier_m: float = 0.05
    """Largest distance that counts, metres."""


class ShapeFound(NamedTuple):
    """The result of the search."""

    sizes: Array
    """Parameters, (n_sizes,), see `SizeParameters`."""
    chamfer_before_m: float
    """Mean chamfer distance over all parts with contours before the search, metres."""
    chamfer_after_m: float
    """The same after it, with the contours as assigned then."""


def search_shapes(
    parameters: SizeParameters,
    person: SightedPerson,
    settings: ChamferSearchSettings,
    report: Callable[[float], None] = lambda share: None,
) -> ShapeFound:
    """Search the shapes of all parts of a person.

    Args:
        parameters: the sizes; 0 is the body to begin with.
        person: the person in two near-orthogonal views, in the pose that is taken as given.
        settings: of the search.
        report: is given the share of the work that is done, 0 to 1. An exception that it raises ends the search.
    """
    sizes, before = np.zeros(len(parameters.names)), np.nan
    groups = _groups(parameters)
    for step in range(settings.passes):
        space = _Space(parameters, person.moved(parameters.body(sizes), person.pose), sizes, settings)
        if step == 0:
            before = space.mean_distance_m(sizes)
        for i, blocks in enumerate(groups):
            report((step * len(groups) + i) / (settings.passes * len(groups)))
            sizes = space.search(sizes, blocks, range(step, settings.levels))
    body = parameters.body(sizes)
    return ShapeFound(
        sizes, before, _Space(parameters, person.moved(body, person.pose), sizes, settings).mean_distance_m(sizes)
    )


def _groups(parameters: SizeParameters) -> list[list[list[int]]]:
    """Return the indices of the parameters of each part, block by block, from the root outwards."""
    owners = dict.fromkeys(n.split(".")[0] for n in parameters.names if "." in n)
    index = {n: i for i, n in enumerate(parameters.names)}
    groups = []
    for owner in owners:
        blocks = [[index[n] for k in names if (n := f"{owner}.{k}") in index] for names in _BLOCKS]
        groups.append([b for b in blocks if b])
    return [g for g in groups if g]


class _Space:
    """The chamfer distances of the parts of one person, by the sizes."""

    def __init__(
        self, parameters: SizeParameters, person: SightedPerson, sizes: Array, settings: ChamferSearchSettings
    ) -> None:
        self._parameters, self._person, self._settings = parameters, person, settings
        self._sizes = sizes
        self._contours = back_project_contours(person)
        self._first = parts_of([b.model for b in person.bodies], person.person).start
        self._surfaces = surfaces_of(tuple(b.model for b in person.bodies))
        self._Ts = [occluding_contours.part_poses(ahead(person.bodies, v.ahead_frames)) for v in person.views]
        sigmas = parameters.sigmas
        is_girth = parameters.of_kinds("girth")
        self._sigmas = np.where(is_girth, np.hypot(sigmas, parameters.priors.build), sigmas)

    def mean_distance_m(self, sizes: Array) -> float:
        """Return the mean chamfer distance over all contours, metres; NaN without contours."""
        return self._distance_m(sizes, range(len(self._parameters.base.parts)))

    def search(self, sizes: Array, blocks: Sequence[Sequence[int]], levels: range) -> Array:
        """Return sizes with the parameters of one part searched, from coarse to fine steps, and go on from there."""
        parts = self._changed_by([i for b in blocks for i in b])
        if not any(c.part in parts for c in self._contours):
            return sizes
        half_range = self._settings.range_sigmas * self._sigmas
        best, best_m = sizes, self._distance_m(sizes, parts)
        for level in levels:
            step = half_range * 0.5 ** (level + 1)
            while True:
                found, found_m = best, best_m
                for block in blocks:
                    found, found_m = self._best_around(found, found_m, block, step, half_range, parts)
                if found is best:
                    break
                best, best_m = found, found_m
        self._surfaces, self._sizes = self._surfaces_at(best), best
        return best

    def _best_around(
        self, sizes: Array, cost_m: float, block: Sequence[int], step: Array, half_range: Array, parts: Sequence[int]
    ) -> tuple[Array, float]:
        """Return the best of the lattice points beside some sizes in one block, or these."""
        best, best_m, at = sizes, cost_m, list(block)
        for signs in product((-1.0, 0.0, 1.0), repeat=len(at)):
            tried = sizes.copy()
            tried[at] += np.array(signs) * step[at]
            if any(signs) and np.all(np.abs(tried[at]) <= half_range[at] + TINY):
                tried_m = self._distance_m(tried, parts)
                if tried_m < best_m - TINY:
                    best, best_m = tried, tried_m
        return best, best_m

    def _changed_by(self, at: Sequence[int]) -> list[int]:
        """Return the parts whose shapes some parameters change."""
        by = self._parameters.derivatives(np.zeros_like(self._sizes))
        return [i for i in range(len(by.half_axes)) if any(np.any(a[i][..., list(at)]) for a in by[1:5])]

    def _distance_m(self, sizes: Array, parts: Sequence[int]) -> float:
        """Return the mean chamfer distance over the contours of some parts, which alone differ from the others."""
        contours = [c for c in self._contours if c.part in parts]
        generators = self._generators(sizes, sorted({c.view for c in contours}))
        distances = [
            chamfer_distance_m(c.plane.cut(generators[c.view][c.part]), c.points_world, self._settings.outlier_m)
            for c in contours
        ]
        return float(np.mean(distances)) if distances else np.nan

    def _generators(self, sizes: Array, views: Sequence[int]) -> dict[int, list[Array]]:
        """Return the visible contour generators of the person's parts in each view, (N, 3) each, metres."""
        surfaces = self._surfaces_at(sizes)
        out = {}
        for view in views:
            camera = self._person.views[view].camera
            traced = occluding_contours.trace_surfaces(surfaces, self._Ts[view], camera, _PIECE_PX)
            middles = (traced.pieces_px[:, :2] + traced.pieces_px[:, 2:]) / 2
            seen = ~traced.occluded & np.all((middles >= 0) & (middles < camera.size), axis=1)
            owners, points = traced.parts[seen] - self._first, traced.points_world[seen]
            out[view] = [points[owners == i] for i in range(len(self._parameters.base.parts))]
        return out

    def _surfaces_at(self, sizes: Array) -> Surfaces:
        """Return the shapes of all people at some sizes; only the parts that differ are sampled again."""
        now, base = (self._parameters.arrays(s)[1:5] for s in (sizes, self._sizes))
        differ = np.any([np.any(a != b, axis=1) for a, b in zip(now, base, strict=True)], axis=0)
        if not differ.any():
            return self._surfaces
        body = self._parameters.body(sizes)
        models = tuple(body if i == self._person.person else b.model for i, b in enumerate(self._person.bodies))
        return resized_surfaces(models, self._surfaces, [self._first + int(i) for i in np.flatnonzero(differ)])


def chamfer_distance_m(model: Array, image: Array, outlier_m: float) -> float:
    """Return the undirected normalized chamfer distance of two point sets in space (GD96 Eq. 1-3).

    Args:
        model: points of the contour generator, (N, 3), metres.
        image: back-projected points of the image, (M, 3), metres.
        outlier_m: largest distance that counts; a set of fewer than half of `MIN_POINTS` points is that far off.
    """
    if len(model) < MIN_POINTS // 2 or not len(image):
        return outlier_m
    middle = image.mean(axis=0)
    a, b = (model - middle).astype(np.float32), (image - middle).astype(np.float32)
    squared = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * (a @ b.T)
    sides = [np.sqrt(np.maximum(squared.min(axis=i), 0.0)) for i in (0, 1)]
    return float(np.mean([np.minimum(s, outlier_m).mean() for s in sides]))
