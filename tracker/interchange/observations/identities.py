"""Find out which detections of different views and frames are of one person.

Detections of two views are of one person if the rays of their points meet. From frame to frame, a person is where the
reprojected points of the frame before are nearest (the Hungarian method, in each view). Place, sizes and colors
together decide who is who after people came near each other or were unseen.
"""

from dataclasses import dataclass, field

import numpy as np

from tracker.body.motion.path_identities import SAME_PERSON_M, Bones, PersonPath, who_is_who
from tracker.compute.quantiles import known_median
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.robust_triangulation import Views, triangulate_points
from tracker.geometry.same_place import INLIER_M


@dataclass(eq=False)
class PersonTrack:
    """A person who is followed, as long as enough views show the person."""

    last_world: Array
    """Last known position of each point, (n_points, 3), metres; NaN where never known."""
    members: dict[tuple[int, int], int]
    """Detection by frame and view."""
    seen: int = 0
    """Last frame with a detection."""
    found: dict[int, Array] = field(default_factory=dict)
    """Points that views show by frame, (n_points, 3), metres; NaN where unknown."""
    legs_m: list[float] = field(default_factory=list)
    """Lengths of the legs from frame to frame, metres, where points of legs are known."""
    thickness_m: dict[int, float] = field(default_factory=dict)
    """Standard deviation of the points from their plane by frame, metres."""

    @property
    def is_flat(self) -> bool:
        """Whether the person is mostly thinner than a limb, whose points have this deviation: as on a poster."""
        return bool(self.thickness_m) and float(np.quantile([*self.thickness_m.values()], 0.75)) < INLIER_M / 12**0.5


def match_people(
    views: Views, points_px: Array, confidence: Array, n_people: int, bones: Bones = (), colors: Array | None = None
) -> IntArray:
    """Return the person of each detection, (n_frames, n_views, n_detections), from 0; -1 for one of nobody.

    The people are those who are seen most, in the order in which they appear.

    Args:
        views: the cameras.
        points_px: undistorted px, (n_frames, n_views, n_detections, n_points, 2); NaN where absent.
        confidence: (n_frames, n_views, n_detections, n_points).
        n_people: number of people of whom the detections are.
        bones: by whose lengths people differ.
        colors: of the clothes, (n_frames, n_views, n_detections, n_colors); NaN where unknown.
    """
    is_present: Mask = np.any(np.isfinite(points_px).all(axis=-1) & (confidence > 0), axis=-1)
    if n_people == 1 and is_present.sum(axis=2).max(initial=0) <= 1:
        return np.where(is_present, 0, -1)
    tracks: list[PersonTrack] = []
    for frame in range(len(points_px)):
        follow_people(views, points_px[frame], confidence[frame], frame, tracks)
    out = np.full(is_present.shape, -1, dtype=np.int64)
    found = everybody(tracks, bones, np.empty((*is_present.shape, 0)) if colors is None else colors)[:n_people]
    for person, own in enumerate(sorted(found, key=lambda own: min(own.members))):
        for (frame, view), detection in own.members.items():
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
    before = max((track.seen for track in tracks), default=frame)
    for row in [t for t, group in taken.items() if len(group) == 1 and tracks[t].seen < before]:
        left.update(taken.pop(row).items())  # who was unseen is back where two views show it
    for group in _groups(views, points_px, confidence, sorted(left)):
        tracks.append(PersonTrack(np.full((*points_px.shape[2:3], 3), np.nan), {}))
        taken[len(tracks) - 1] = group
    for t, group in taken.items():
        tracks[t].members |= {(frame, v): d for v, d in group.items()}
        tracks[t].seen = frame
        chosen = np.array([[group.get(v, -1) for v in range(len(is_present))]])
        found = triangulate_points(views, *gather(points_px[None], confidence[None], chosen)).points_world[0]
        known = np.isfinite(found).all(axis=-1)
        tracks[t].last_world[known], tracks[t].found[frame] = found[known], found
        if known.sum() > 3:
            off = np.linalg.svd(found[known] - found[known].mean(axis=0), compute_uv=False)[-1]
            tracks[t].thickness_m[frame] = float(off / np.sqrt(known.sum()))
    for track in [t for t in tracks if t.seen == frame]:
        double = next((t for t in tracks[: tracks.index(track)] if t.seen == frame and _is_same(t, track)), None)
        if double is not None:
            double.members, double.found = track.members | double.members, track.found | double.found
            tracks.remove(track)


def _is_same(one: PersonTrack, other: PersonTrack) -> bool:
    """Return whether two people are at the place of one, and most pictures show one of them alone."""
    is_near = known_median(np.linalg.norm(one.last_world - other.last_world, axis=-1)) < SAME_PERSON_M
    n_both, n_least = len(one.members.keys() & other.members), min(len(one.members), len(other.members))
    return bool(is_near and 2 * n_both < n_least)


def track_distance(views: Views, view: int, points_world: Array, points_px: Array, confidence: Array) -> float:
    """Return the median distance of a detection from points in space, metres; 1e3 if nothing can be compared."""
    projected, depths = views.project(points_world)
    apart = np.linalg.norm(projected[:, view] - points_px, axis=-1) * depths[:, view] / views.focal_px[view]
    return float(np.nan_to_num(known_median(np.where(confidence > 0, apart, np.nan)), nan=1e3))


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
            if (gap := float(known_median(apart))) < INLIER_M:
                pairs.append((gap, (v, d), (w, e)))
    groups = {at: {at[0]: at[1]} for at in detections}
    for _, one, other in sorted(pairs):
        a, b = groups[one], groups[other]
        if a is not b and not a.keys() & b.keys():
            a |= b
            for at in b.items():
                groups[at] = a
    unique = {id(g): g for g in groups.values() if len(g) > 1}
    return list(unique.values())


def everybody(tracks: list[PersonTrack], bones: Bones, colors: Array) -> list[PersonTrack]:
    """Return who is seen on all frames, a person with more detections first, a flat picture of one last.

    Args:
        tracks: people as place alone shows them.
        bones: see `match_people`.
        colors: see `match_people`.
    """
    colors = colors - known_median(np.concatenate(np.swapaxes(colors, 1, 2)))[:, None]
    paths, people = [], dict[int, PersonTrack]()
    for track in tracks:
        frames = sorted(track.found)
        looks = np.full((len(frames), *colors.shape[1::2]), np.nan)
        for (frame, view), detection in track.members.items():
            looks[np.searchsorted(frames, frame), view] = colors[frame, view, detection]
        paths.append(PersonPath.of(frames, np.array([track.found[k] for k in frames]), bones, looks))
    for track, path, persons in zip(tracks, paths, who_is_who(paths, SAME_PERSON_M), strict=True):
        by_frame = dict(zip(path.frames.tolist(), persons.tolist(), strict=True))
        for (frame, view), detection in track.members.items():
            own = people.setdefault(by_frame[frame], PersonTrack(track.last_world, {}))
            own.members[frame, view] = detection
            own.thickness_m |= {frame: track.thickness_m[frame]} if frame in track.thickness_m else {}
    return sorted(people.values(), key=lambda own: (own.is_flat, -len(own.members)))


def gather(px: Array, confidence: Array, detections: IntArray) -> tuple[Array, Array]:
    """Return points, (n_frames, n_views, n_points, 2), and confidence of one detection in each frame and view."""
    at = np.maximum(detections, 0)[..., None, None]
    own = np.take_along_axis(confidence, at, axis=2)[:, :, 0]
    own_px = np.take_along_axis(px, at[..., None], axis=2)[:, :, 0]
    known = (detections >= 0)[..., None]
    own = np.where(known & np.isfinite(own_px).all(axis=-1), own, 0.0)
    return np.where(own[..., None] > 0, own_px, np.nan), own
