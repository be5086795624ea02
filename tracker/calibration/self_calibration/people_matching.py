"""Find out which detections of different cameras are of one person, by cameras that are about right.

On each frame, detections of a camera are assigned to the people of the other cameras by the Hungarian method. The cost
is the distance at which the viewing rays of their joints pass each other. Names of a file are votes on who it is.
"""

from typing import NamedTuple

import numpy as np

from tracker.calibration.self_calibration.seen_joints import points_of_person
from tracker.compute.quantiles import known_median
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.robust_triangulation import Views, triangulate_points
from tracker.geometry.same_place import INLIER_M
from tracker.interchange.observations.checks import point_rays
from tracker.interchange.observations.observed import ObservationSet, side_pairs


class MatchedPeople(NamedTuple):
    """People who were matched across the cameras."""

    persons: IntArray
    """Person of each detection, (n_frames, n_views, n_detections); -1 for one that is left out."""
    n_people: int
    """Number of people: those who have names, then others."""
    is_exchanged: Mask
    """Whether a detection is of another person than its file says, (n_frames, n_views, n_detections)."""


def match_across_cameras(observations: ObservationSet, views: Views, named: IntArray, n_named: int) -> MatchedPeople:
    """Match people across cameras on each frame, and follow them from frame to frame.

    Args:
        observations: key points in pictures.
        views: cameras that are about right, metres.
        named: person of each detection by its file, (n_frames, n_views, n_detections); -1 for one without a name.
        n_named: number of people who have names.
    """
    gaps = _ray_gaps(observations, views)
    points = observations.points
    assert points is not None
    present = np.asarray(points.is_known.any(axis=-1))
    groups = np.stack([_grouped(gaps[k], present[k]) for k in range(len(gaps))])
    n_groups = max(1, int(groups.max(initial=-1)) + 1)
    places = np.stack([_places(observations, views, groups == g) for g in range(n_groups)], axis=1)
    n_people = max(n_named, n_groups)
    votes = np.stack(
        [
            ((groups == g)[..., None] & (named[..., None] == np.arange(n_people))).sum(axis=(1, 2))
            for g in range(n_groups)
        ],
        axis=1,
    )
    followed = _followed(votes, places, [np.unique(own[own >= 0]) for own in groups])
    persons = followed[np.arange(len(groups))[:, None, None], groups]
    persons[groups < 0] = -1
    return MatchedPeople(persons, n_people, (persons >= 0) & (named >= 0) & (persons != named))


def _ray_gaps(observations: ObservationSet, views: Views) -> Array:
    """Return the median distance of the rays of two detections, (F, V, D, V, D), metres; NaN where they share no joint.

    Left and right may be exchanged in one of the two: sides are mended later.
    """
    points = observations.points
    assert points is not None
    rays = point_rays(views, points.points_px, points.is_known)
    same = np.arange(rays.shape[3])
    mirrored = same.copy()
    for left, right in (pair for group in side_pairs(observations) for pair in group):
        mirrored[[left, right]] = right, left
    n_frames, n_views, n_detections = rays.shape[:3]
    out = np.full((n_frames, n_views, n_detections, n_views, n_detections), np.nan)
    for a in range(n_views):
        for b in range(a + 1, n_views):
            for d in range(n_detections):
                apart = [views.ray_distances(a, b, rays[:, a, d, None], rays[:, b][:, :, i]) for i in (same, mirrored)]
                out[:, a, d, b] = out[:, b, :, a, d] = np.fmin(*(known_median(np.moveaxis(x, -1, 0)) for x in apart))
    return out


def _grouped(gaps: Array, present: Mask) -> IntArray:
    """Return the group of each detection of a frame, (V, D), from 0; -1 for one that is alone or not clearly of one.

    Args:
        gaps: distance of each two detections, (V, D, V, D), metres.
        present: whether there is a detection, (V, D).
    """
    groups, before = np.full(present.shape, -1), None
    order = np.argsort(-present.sum(axis=1), kind="stable")
    for _ in order:  # until nothing changes, usually twice
        for v in order:
            groups[v] = _assigned(_costs(gaps, groups, v), np.flatnonzero(present[v]), groups, v)
        if before is not None and np.array_equal(before, groups):
            break
        before = groups.copy()
    groups = np.where(_is_clear(gaps, groups), groups, -1)
    numbers, counts = np.unique(groups[groups >= 0], return_counts=True)
    groups[np.isin(groups, numbers[counts < 2])] = -1
    groups[groups >= 0] = np.unique(groups[groups >= 0], return_inverse=True)[1]
    return groups


def _is_clear(gaps: Array, groups: IntArray) -> Mask:
    """Return which detections are of their group, and at least twice as near to it as any others are, (V, D)."""
    out = np.zeros(groups.shape, dtype=bool)
    for v in range(len(groups)):
        costs = _costs(gaps, groups, v)
        for d in np.flatnonzero(groups[v] >= 0):
            g = groups[v, d]
            others = np.concatenate([np.delete(costs[:, d], g), np.delete(costs[g], d)])
            out[v, d] = costs[g, d] < INLIER_M and not (others < 2 * costs[g, d]).any()
    return out


def _costs(gaps: Array, groups: IntArray, v: int) -> Array:
    """Return the median distance of each detection of a view from the members of each group in others, (G, D)."""
    out = np.full((groups.size, groups.shape[1]), np.nan)
    for g in np.unique(groups[groups >= 0]):
        members = [(w, d) for w, d in zip(*np.nonzero(groups == g), strict=True) if w != v]
        out[g] = known_median(np.array([gaps[v, :, w, d] for w, d in members]).reshape(-1, groups.shape[1]))
    return out


def _assigned(costs: Array, detections: IntArray, groups: IntArray, v: int) -> IntArray:
    """Return the groups of the detections of a view, (D,): those of other views, or new ones."""
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    out = np.full(groups.shape[1], -1)
    limited = np.minimum(np.nan_to_num(costs[:, detections], nan=INLIER_M), INLIER_M)
    for g, i in zip(*linear_sum_assignment(limited), strict=True):
        if limited[g, i] < INLIER_M:
            out[detections[i]] = g
    others = np.delete(groups, v, axis=0)
    free = (g for g in range(groups.size) if g not in others and g not in out)
    for d in detections[out[detections] < 0]:
        out[d] = next(free)
    return out


def _places(observations: ObservationSet, views: Views, is_own: Mask) -> Array:
    """Return the middle of the joints of a group on each frame, (F, 3), metres; NaN where unknown."""
    px, confidence = points_of_person(observations, is_own)
    px = views.undistorted(px)
    found = triangulate_points(views, px, np.where(np.isfinite(px).all(axis=-1), confidence, 0.0)).points_world
    return known_median(np.moveaxis(found, 1, 0))


def _followed(votes: IntArray, places: Array, present: list[IntArray]) -> IntArray:
    """Return the person of each group on each frame, (F, G): whom most cameras name, and the nearest where none does.

    Args:
        votes: number of detections that have the name of each person, (F, G, P).
        places: of the groups, (F, G, 3), metres.
        present: groups of each frame.
    """
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    n_frames, n_groups, n_people = votes.shape
    last = np.full((n_people, 3), np.nan)
    out = np.full((n_frames, n_groups), -1)
    for k, some in enumerate(present):
        away = np.linalg.norm(places[k, some, None] - last, axis=-1)
        # A distance decides between equal votes alone.
        costs = np.tanh(np.nan_to_num(away, nan=np.inf)) - votes[k, some]
        for i, person in zip(*linear_sum_assignment(costs), strict=True):
            out[k, some[i]] = person
            if np.isfinite(places[k, some[i]]).all():
                last[person] = places[k, some[i]]
    return out
