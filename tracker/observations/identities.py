"""Find out which detections of different views and frames are of one person.

Detections of two views are of one person if the rays of their points meet. From frame to frame, a person is where the
reprojected points of the frame before are nearest (the Hungarian method, in each view).
"""

from dataclasses import dataclass, field

import numpy as np

from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.observations.triangulation import INLIER_M, Views, triangulate_points

SAME_PERSON_M = 0.4
"""Largest median distance, metres, of a detection's points from a person's a frame before: a person is as wide."""


@dataclass(eq=False)
class PersonTrack:
    """A person who is followed, as long as enough views show the person."""

    last_world: Array
    """Last known position of each point, (n_points, 3), metres; NaN where never known."""
    members: dict[tuple[int, int], int]
    """Detection by frame and view."""
    seen: int = 0
    """Last frame with a detection."""
    legs_m: list[float] = field(default_factory=list)
    """Lengths of the legs from frame to frame, metres, where points of legs are known."""
    thickness_m: list[float] = field(default_factory=list)
    """Standard deviation of the points from their plane, from frame to frame, metres."""

    @property
    def is_flat(self) -> bool:
        """Whether the person is mostly thinner than a limb, whose points have this deviation: as on a poster."""
        return bool(self.thickness_m) and float(np.quantile(self.thickness_m, 0.75)) < INLIER_M / 12**0.5


def match_people(views: Views, points_px: Array, confidence: Array, n_people: int) -> IntArray:
    """Return the person of each detection, (n_frames, n_views, n_detections), from 0; -1 for one of nobody.

    The people are those who are seen most, in the order in which they appear.

    Args:
        views: the cameras.
        points_px: undistorted px, (n_frames, n_views, n_detections, n_points, 2); NaN where absent.
        confidence: (n_frames, n_views, n_detections, n_points).
        n_people: number of people of whom the detections are.
    """
    is_present = (np.isfinite(points_px).all(axis=-1) & (confidence > 0)).any(axis=-1)
    assert isinstance(is_present, np.ndarray)
    if n_people == 1 and is_present.sum(axis=2).max(initial=0) <= 1:
        return np.where(is_present, 0, -1)
    tracks: list[PersonTrack] = []
    for frame in range(len(points_px)):
        follow_people(views, points_px[frame], confidence[frame], frame, tracks)
    out = np.full(is_present.shape, -1, dtype=np.int64)
    for person, some in enumerate(most_seen_people(tracks, n_people)):
        for track in some:
            for (frame, view), detection in track.members.items():
                out[frame, view, detection] = person
    return out


def follow_people(views: Views, points_px: Array, confidence: Array, frame: int, tracks: list[PersonTrack]) -> None:
    """Assign the detections of a frame to the tracks, and begin tracks with those that are left.

    Args:
        views: the cameras.
        points_px: undistorted px, (n_views, n_detections, n_points, 2); NaN where absent.
        confidence: (n_views, n_detections, n_points).
        frame: its number.
        tracks: of the frames before; they are extended.
    """
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    is_present: Mask = np.any(np.isfinite(points_px).all(axis=-1) & (confidence > 0), axis=-1)
    taken: dict[int, dict[int, int]] = {}
    left = {(v, int(d)) for v in range(len(is_present)) for d in np.flatnonzero(is_present[v])}
    for v in range(len(is_present)):
        detections = [d for view, d in sorted(left) if view == v]
        if not (detections and tracks):
            continue
        px, sure, last = points_px[v], confidence[v], [track.last_world for track in tracks]
        distances = np.array([[track_distance(views, v, x, px[d], sure[d]) for d in detections] for x in last])
        for row, i in zip(*linear_sum_assignment(distances), strict=True):
            if distances[row, i] < SAME_PERSON_M:
                taken.setdefault(int(row), {})[v] = detections[i]
                left.discard((v, detections[i]))
    for group in _groups(views, points_px, confidence, sorted(left)):
        tracks.append(PersonTrack(np.full((*points_px.shape[2:3], 3), np.nan), {}))
        taken[len(tracks) - 1] = group
    for t, group in taken.items():
        tracks[t].members |= {(frame, v): d for v, d in group.items()}
        tracks[t].seen = frame
        chosen = [group.get(v, -1) for v in range(len(is_present))]
        px = np.stack(
            [points_px[v, d] if d >= 0 else np.full_like(points_px[v, 0], np.nan) for v, d in enumerate(chosen)]
        )
        weights = np.stack([confidence[v, d] * (d >= 0) for v, d in enumerate(chosen)])
        found = triangulate_points(views, px[None], weights[None]).points_world[0]
        known = np.isfinite(found).all(axis=-1)
        tracks[t].last_world[known] = found[known]
        if known.sum() > 3:
            off = np.linalg.svd(found[known] - found[known].mean(axis=0), compute_uv=False)[-1]
            tracks[t].thickness_m.append(float(off / np.sqrt(known.sum())))
    for track in [t for t in tracks if t.seen == frame]:
        double = next((t for t in tracks[: tracks.index(track)] if t.seen == frame and _is_same(t, track)), None)
        if double is not None:
            double.members = track.members | double.members
            tracks.remove(track)


def _is_same(one: PersonTrack, other: PersonTrack) -> bool:
    """Return whether two people are at the place of one, and most pictures show one of them alone."""
    apart = np.linalg.norm(one.last_world - other.last_world, axis=-1)
    known = np.isfinite(apart)
    is_near = known.any() and np.median(apart[known]) < SAME_PERSON_M
    n_both, n_least = len(one.members.keys() & other.members), min(len(one.members), len(other.members))
    return bool(is_near and 2 * n_both < n_least)


def track_distance(views: Views, view: int, points_world: Array, points_px: Array, confidence: Array) -> float:
    """Return the median distance of a detection from points in space, metres; 1e3 if nothing can be compared."""
    projected, depths = views.project(points_world)
    apart = np.linalg.norm(projected[:, view] - points_px, axis=-1) * depths[:, view] / views.focal_px[view]
    known = np.isfinite(apart) & (confidence > 0)
    return float(np.median(apart[known])) if known.any() else 1e3


def _groups(
    views: Views, points_px: Array, confidence: Array, detections: list[tuple[int, int]]
) -> list[dict[int, int]]:
    """Join detections of different views whose rays meet, nearest first; groups of one view alone are left out."""
    rays = {(v, d): views.cameras[v].pinhole.rays(points_px[v, d]) for v, d in detections}
    pairs = []
    for i, (v, d) in enumerate(detections):
        for w, e in detections[i + 1 :]:
            if v == w:
                continue
            both = (confidence[v, d] > 0) & (confidence[w, e] > 0)
            apart = views.ray_distances(v, w, rays[v, d][both], rays[w, e][both])
            apart = apart[np.isfinite(apart)]
            if len(apart) and np.median(apart) < INLIER_M:
                pairs.append((float(np.median(apart)), (v, d), (w, e)))
    groups = {at: {at[0]: at[1]} for at in detections}
    for _, one, other in sorted(pairs):
        a, b = groups[one], groups[other]
        if a is not b and not a.keys() & b.keys():
            a |= b
            for at in b.items():
                groups[at] = a
    unique = {id(g): g for g in groups.values() if len(g) > 1}
    return list(unique.values())


def most_seen_people(tracks: list[PersonTrack], n_people: int) -> list[list[PersonTrack]]:
    """Join tracks that follow one another to people; in order of appearance.

    A person with more detections comes first, a flat picture of one last.
    """
    people: list[list[PersonTrack]] = []
    for track in sorted(tracks, key=lambda t: (t.is_flat, -len(t.members))):
        frames = {frame for frame, _ in track.members}
        free = [some for some in people if not any(frames & {f for f, _ in t.members} for t in some)]
        if len(people) < n_people:
            people.append([track])
        elif free:
            min(free, key=lambda some: _gap(some, track)).append(track)
    return sorted(people, key=lambda some: min(min(t.members) for t in some))


def _gap(some: list[PersonTrack], track: PersonTrack) -> float:
    """Return the distance of the last positions of a person and of a track, metres."""
    apart = [np.nanmedian(np.linalg.norm(t.last_world - track.last_world, axis=-1)) for t in some]
    return float(np.min(apart))
