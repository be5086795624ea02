"""Joints in space of observations: as they were imported, or triangulated from key points."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import Views, triangulate_points
from tracker.interchange.observations.identities import gather, match_people
from tracker.interchange.observations.observed import ObservationSet, ObservedJoints
from tracker.interchange.observations.sides import exchanged_sides, with_sides_exchanged

_GROUPS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "heel", "toe"))
"""Joints whose sides a detector exchanges together: those of the arms, and those of the legs."""


@dataclass(frozen=True, eq=False)
class TriangulatedObservations:
    """Key points of people, matched across the views and triangulated."""

    joints: ObservedJoints
    identities: IntArray
    """Person of each detection, (n_frames, n_views, n_detections); -1 for one of nobody."""
    detections: IntArray
    """Detection of each person, (n_frames, n_people, n_views); -1 where a view shows none."""
    is_exchanged: Mask
    """Whether left and right were exchanged in a view, and mended, (n_frames, n_people, n_views, 2): arms, legs."""
    is_inlier: Mask
    """Whether a view agrees with a point, (n_frames, n_people, n_views, n_points)."""
    residuals_px: Array
    """Distance of each observation from its point, (n_frames, n_people, n_views, n_points), undistorted px."""
    positions_px: Array
    """Each observation with its sides mended, (n_frames, n_people, n_views, n_points, 2), undistorted px; NaN where
    absent."""
    confidence: Array
    """Its confidence, (n_frames, n_people, n_views, n_points), 0 to 1; 0 where absent."""


def observed_joints(observations: ObservationSet, cameras: Sequence[Camera]) -> ObservedJoints:
    """Return the joints of observations in space; key points are triangulated with the present calibration.

    Args:
        observations: of any kind.
        cameras: of the session, in its order.
    """
    if observations.joints is not None:
        return observations.joints
    return triangulate_observations(observations, cameras).joints


def triangulate_observations(
    observations: ObservationSet, cameras: Sequence[Camera], mend_sides: bool = True
) -> TriangulatedObservations:
    """Match the people of key points across views and frames, and triangulate their points.

    Args:
        observations: with key points.
        cameras: of the session, in its order.
        mend_sides: exchange left and right in views that contradict the others.
    """
    points = observations.points
    assert points is not None
    views = Views(cameras)
    px = views.undistorted(points.points_px)
    people = observations.people
    identities = match_people(views, px, points.confidence, len(people), bones_of(observations), points.colors)
    detections = np.stack([_detections_of(identities, p) for p in range(len(people))], axis=1)
    groups = side_pairs(observations)
    found = []
    for person in range(len(people)):
        own_px, own_confidence = gather(px, points.confidence, detections[:, person])
        flags = np.zeros((*own_confidence.shape[:2], len(groups)), dtype=bool)
        for g, pairs in enumerate(groups if mend_sides else ()):
            flags[..., g] = exchanged_sides(views, own_px, own_confidence, pairs)
            own_px = with_sides_exchanged(own_px, pairs, flags[..., g])
            own_confidence = with_sides_exchanged(own_confidence, pairs, flags[..., g])
        found.append((flags, own_px, own_confidence, *triangulate_points(views, own_px, own_confidence)))
    flags, own_px, own_confidence, *of_joints = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    world, covariances, residuals_px, is_inlier = of_joints
    joints = ObservedJoints(points.names, people, world, covariances)
    return TriangulatedObservations(
        joints, identities, detections, flags, is_inlier, residuals_px, own_px, own_confidence
    )


def side_pairs(observations: ObservationSet) -> list[list[tuple[int, int]]]:
    """Return the columns of the left and the right point of each pair, for the arms and for the legs."""
    at = {points[0]: i for i, points in enumerate(observations.counterparts.values()) if len(points) == 1}
    return [
        [(at[f"left_{j}"], at[f"right_{j}"]) for j in joints if f"left_{j}" in at and f"right_{j}" in at]
        for joints in _GROUPS
    ]


def bones_of(observations: ObservationSet) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the columns of both sides of each bone of the arms and legs, and from the shoulders to the hips."""
    groups = side_pairs(observations)
    return [*pairwise(g[0] for g in groups if g), *(bone for g in groups for bone in pairwise(g))]


def _detections_of(identities: IntArray, person: int) -> IntArray:
    """Return the detection of a person in each frame and view, (n_frames, n_views); -1 where there is none."""
    own = identities == person
    return np.where(own.any(axis=-1), own.argmax(axis=-1), -1)
