"""Back-project the image contours of each part to its occluding contours in space (GD96 Sect. 3).

The occluding contour of a quadric is planar: it lies in the polar plane of the eye (e.g. Hartley & Zisserman 2004,
Sect. 8.3). Parts are nearly quadrics, so that the lines of sight of their contours are cut off at that plane. The
contours of the fitted part are cut off there too: on a flat end the depth of its generator is not defined.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody, ahead, parts_of
from tracker.estimation.acquisition.size_fit import SightedPerson
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.edge_segments import MAX_ANGLE_RAD
from tracker.evidence.images.silhouette_contour import MIN_TRUST
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, FloatArray, IntArray
from tracker.geometry.cameras import Camera

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
