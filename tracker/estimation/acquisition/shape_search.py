"""Search the shape of each part by the chamfer distance in space, coarse to fine (GD96 Sect. 3).

Back-projected image contours are compared with the contour generators of the part. The distance is the undirected
normalized chamfer distance (GD96 Eq. 1-3) between points in space, averaged over the contours of the part. The poses
and the lengths stay, so that joints keep their places.

Back-project the image contours of each part to its occluding contours in space (GD96 Sect. 3).

The occluding contour of a quadric is planar: it lies in the polar plane of the eye (e.g. Hartley & Zisserman 2004,
Sect. 8.3). Parts are nearly quadrics, so that the lines of sight of their contours are cut off at that plane. The
contours of the fitted part are cut off there too: on a flat end the depth of its generator is not defined.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody, ahead, parts_of
from tracker.estimation.acquisition.size_fit import SightedPerson
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.surfaces import Surfaces, resized_surfaces, surfaces_of
from tracker.evidence.images.edge_segments import MAX_ANGLE_RAD
from tracker.evidence.images.silhouette_contour import MIN_TRUST
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, FloatArray, IntArray
from tracker.geometry.cameras import Camera

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


class ShapeSearchResult(NamedTuple):
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
) -> ShapeSearchResult:
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
    return ShapeSearchResult(
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


MIN_POINTS = 8
"""Smallest number of points of a contour that is compared."""
_NEIGHBORS = 6
"""Number of near pieces of contour of which one must run as the edge does."""
_MAX_REACH = 2.0
"""Largest distance of a back-projected point from the centre of its part, in bounding radii."""


class PolarPlane(NamedTuple):
    """The plane in which the occluding contour of a part lies: `normal . x = offset`."""

    eye: Array
    """Camera centre, (3,), metres."""
    normal: Array
    """(3,), per metre; not of unit length."""
    offset: float

    def cut(self, points_world: Array) -> Array:
        """Move points, (N, 3), along their lines of sight into the plane."""
        rays = points_world - self.eye
        slopes = rays @ self.normal
        depths = (self.offset - self.normal @ self.eye) / np.where(slopes < 0, slopes, np.nan)
        return np.asarray(self.eye + depths[:, None] * rays)


class OccludingContour(NamedTuple):
    """The occluding contour of a part in one view, back-projected from the image."""

    view: int
    """Index of the view."""
    part: int
    """Index of the part of the person."""
    points_world: Array
    """Points of the contour, (N, 3), metres, in the plane."""
    plane: PolarPlane
    """Ends at which the lines of sight were cut off."""


def back_project_contours(person: SightedPerson) -> list[OccludingContour]:
    """Return the occluding contours of all parts in all views that have at least `MIN_POINTS` points."""
    first, out = parts_of([b.model for b in person.bodies], person.person).start, []
    for i, view in enumerate(person.views):
        people = ahead(person.bodies, view.ahead_frames)
        body, (points_px, parts) = people[person.person], explained_points(view, people)
        for part in range(len(body.model.parts)):
            own = points_px[parts == first + part]
            if len(own) < MIN_POINTS:
                continue
            plane = polar_plane(view.camera, body, part)
            points = plane.cut(view.camera.center_world + view.camera.rays(own))
            middle = rigid.apply(body.kinematics.Ts_world_part[part], body.model.centers_part[part])
            reach = _MAX_REACH * np.linalg.norm(body.model.shapes[part].half_axes)
            points = points[np.linalg.norm(points - middle, axis=1) <= reach]
            if len(points) >= MIN_POINTS:
                out.append(OccludingContour(i, part, points, plane))
    return out


def explained_points(view: ViewEvidence, bodies: Sequence[PosedBody]) -> tuple[Array, IntArray]:
    """Segment the contours of a view: assign each point of edges and silhouette to the part whose contour explains it.

    GD96 assume this segmentation. Here a point belongs to the nearest visible piece of contour of similar direction
    within theta.

    Returns:
        The points that some part explains, (N, 2), px of the view, and the part of each, (N,), counted through all
        bodies.
    """
    contour = occluding_contours.trace(bodies, view.camera)
    pieces, parts = contour.pieces_px[~contour.occluded], contour.parts[~contour.occluded].astype(np.int64)
    points, normals = _all_points(view)
    if not len(pieces) or not len(points):
        return np.empty((0, 2)), np.empty(0, np.int64)
    along = pieces[:, 2:] - pieces[:, :2]
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), TINY)
    from scipy.spatial import cKDTree  # here: it takes a sixth of the time in which the program loads

    tree = cKDTree((pieces[:, :2] + pieces[:, 2:]) / 2)
    distances, near = tree.query(points, k=np.arange(1, _NEIGHBORS + 1), distance_upper_bound=view.theta_px)
    known = np.isfinite(distances)
    near = np.where(known, near, 0)
    sines = np.abs(np.einsum("ni,nki->nk", normals, along[near]))  # 0 where the normal is across the contour
    alike = known & (sines <= np.sin(MAX_ANGLE_RAD))
    found = alike.any(axis=1)
    nearest = near[np.arange(len(near)), np.argmax(alike, axis=1)]
    return np.asarray(points[found], dtype=np.float64), parts[nearest[found]]


def _all_points(view: ViewEvidence) -> tuple[FloatArray, FloatArray]:
    """Return all pixels of accepted edges and of a trusted silhouette, (N, 2) px, with their normals, (N, 2)."""
    points, normals, segments = view.points_px, view.normals, view.segments
    if segments is not None:
        accepted = np.ones(len(segments.firsts) - 1, np.bool_) if view.accepted is None else view.accepted
        own = np.repeat(accepted, np.diff(segments.firsts))
        points, normals = segments.points_px[own], segments.normals[own]
    if view.silhouette is not None and view.silhouette.trust >= MIN_TRUST:
        contour = view.silhouette.contour
        points, normals = np.concatenate([points, contour.points_px]), np.concatenate([normals, contour.normals])
    return points, normals


def polar_plane(camera: Camera, body: PosedBody, part: int) -> PolarPlane:
    """Return the polar plane of the eye in a part: `e . x = 1` of the eye e in the part's unit coordinates."""
    T, half_axes = body.kinematics.Ts_world_part[part], np.array(body.model.shapes[part].half_axes)
    eye, middle = camera.center_world, rigid.apply(T, body.model.centers_part[part])
    unit_eye = (eye - middle) @ T[:3, :3] / half_axes
    normal = T[:3, :3] @ (unit_eye / half_axes)
    return PolarPlane(eye, normal, float(1 + normal @ middle))
