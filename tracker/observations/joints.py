"""Joints in space of observations: as they were imported, or triangulated from key points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.observations.identities import match_people
from tracker.observations.observed import ObservationSet, ObservedJoints
from tracker.observations.sides import exchanged_sides, with_sides_exchanged
from tracker.observations.triangulation import Triangulated, Views, triangulate_points

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
    identities = match_people(views, px, points.confidence, len(people))
    detections = np.stack([_detections_of(identities, p) for p in range(len(people))], axis=1)
    groups = side_pairs(observations)
    found: list[Triangulated] = []
    exchanged, positions, confidences = [], [], []
    for person in range(len(people)):
        own_px, own_confidence = _gather(px, points.confidence, detections[:, person])
        flags = np.zeros((*own_confidence.shape[:2], len(groups)), dtype=bool)
        for g, pairs in enumerate(groups if mend_sides else ()):
            flags[..., g] = exchanged_sides(views, own_px, own_confidence, pairs)
            own_px = with_sides_exchanged(own_px, pairs, flags[..., g])
            own_confidence = with_sides_exchanged(own_confidence, pairs, flags[..., g])
        found.append(triangulate_points(views, own_px, own_confidence))
        positions.append(own_px)
        confidences.append(own_confidence)
        exchanged.append(flags)
    world, covariances, residuals_px, is_inlier = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    joints = ObservedJoints(points.names, people, world, covariances)
    is_exchanged, positions_px, confidence = (np.stack(part, axis=1) for part in (exchanged, positions, confidences))
    return TriangulatedObservations(
        joints, identities, detections, is_exchanged, is_inlier, residuals_px, positions_px, confidence
    )


def side_pairs(observations: ObservationSet) -> list[list[tuple[int, int]]]:
    """Return the columns of the left and the right point of each pair, for the arms and for the legs."""
    at = {points[0]: i for i, points in enumerate(observations.counterparts.values()) if len(points) == 1}
    return [
        [(at[f"left_{j}"], at[f"right_{j}"]) for j in joints if f"left_{j}" in at and f"right_{j}" in at]
        for joints in _GROUPS
    ]


def _detections_of(identities: IntArray, person: int) -> IntArray:
    """Return the detection of a person in each frame and view, (n_frames, n_views); -1 where there is none."""
    own = identities == person
    return np.where(own.any(axis=-1), own.argmax(axis=-1), -1)


def _gather(px: Array, confidence: Array, detections: IntArray) -> tuple[Array, Array]:
    """Return points, (n_frames, n_views, n_points, 2), and confidence of one detection in each frame and view."""
    at = np.maximum(detections, 0)[..., None, None]
    own = np.take_along_axis(confidence, at, axis=2)[:, :, 0]
    own_px = np.take_along_axis(px, at[..., None], axis=2)[:, :, 0]
    known = (detections >= 0)[..., None]
    own = np.where(known & np.isfinite(own_px).all(axis=-1), own, 0.0)
    return np.where(own[..., None] > 0, own_px, np.nan), own
