"""The people of a recording, frame after frame, by a detector that sees one picture at a time.

Views know more together than each alone: where a person stands, and with which side up. A person is therefore sought in
every view around the place that the other views and the frame before show, and with the feet where the floor is.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.footage.image_file import ANYONE, UNKNOWN
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import NEAR_PLANE_M, Camera, viewed_point
from tracker.geometry.robust_triangulation import Views
from tracker.geometry.same_place import INLIER_M
from tracker.interchange.detection.detector import ADULT, DetectedPerson, Detector, PictureSquare
from tracker.interchange.observations.identities import SAME_PERSON_M, PersonTrack, follow_people, track_distance
from tracker.interchange.observations.observed import ObservationSet


def clothes_colors(picture: Image, torso_px: Array, knees_px: Array) -> Array:
    """Return the median colors of trunk and thighs, (6,), CIELAB of 8 bits; NaN for one that the picture does not show.

    Args:
        picture: (H, W, 3) RGB.
        torso_px: left and right shoulder, left and right hip, (4, 2), px.
        knees_px: left and right knee, (2, 2), px.
    """
    shares = np.linspace(0.2, 0.8, 7)  # the edges may show what is behind the person
    left, right = (torso_px[side] + shares[:, None] * (torso_px[side + 2] - torso_px[side]) for side in (0, 1))
    trunk = left[:, None] + shares[None, :, None] * (right - left)[:, None]
    thighs = torso_px[2:] + shares[:, None, None] * (knees_px - torso_px[2:])
    return np.concatenate([_median_color(picture, places.reshape(-1, 2)) for places in (trunk, thighs)])


def _median_color(picture: Image, places_px: Array) -> Array:
    """Return the median color of some places, (n, 2), px; NaN if fewer than half of them are within the picture."""
    known = places_px[np.isfinite(places_px).all(axis=1)].round().astype(int)
    inside = known[((known >= 0) & (known < picture.shape[1::-1])).all(axis=1)]
    if 2 * len(inside) < len(places_px):
        return np.full(3, np.nan)
    colors = cv2.cvtColor(np.ascontiguousarray(picture[inside[:, 1], inside[:, 0]][None]), cv2.COLOR_RGB2LAB)
    return np.asarray(np.median(colors[0], axis=0), dtype=np.float64)


_TORSO = ("left_shoulder", "right_shoulder", "left_hip", "right_hip")
_LEGS = (("left_hip", "left_knee", "left_ankle"), ("right_hip", "right_knee", "right_ankle"))
_FIND_EVERY_S = 0.5
"""Time between two searches of whole pictures for people who enter, seconds: at 1.4 m/s (R. Bohannon 1997) someone
walks 0.7 m meanwhile. A person who is lost is sought at the last place until then."""

Seen: TypeAlias = list[list[DetectedPerson]]
"""The people whom each view sees on a frame."""


class PeopleInViews:
    """Finds people in the pictures of all cameras, and follows them."""

    def __init__(
        self, detector: Detector, body_points: Mapping[str, int], n_points: int, cameras: Sequence[Camera], up: Array,
        fps: float,
    ) -> None:  # fmt: skip
        """Begin with nobody.

        Args:
            detector: sees a picture.
            body_points: index of the detector's point for points of the body, those of the torso among them.
            n_points: number of the detector's points.
            cameras: of all views.
            up: unit vector that points up, (3,), world.
            fps: frames per second.
        """
        self._detector, self._views, self._up = detector, Views(cameras), up
        self._torso, self._n_points = [body_points[name] for name in _TORSO], n_points
        self._legs = np.array([[body_points[name] for name in leg] for leg in _LEGS])
        self.every = max(1, round(_FIND_EVERY_S * fps))
        self._middle = viewed_point(cameras)
        self._last_search: int | None = None
        self.tracks: list[PersonTrack] = []

    @property
    def names(self) -> list[str]:
        """Names of the views."""
        return [c.name for c in self._views.cameras]

    @property
    def number(self) -> int:
        """Number of people at once, each seen by three views or all, on as many frames as `every` at least."""
        at_once = Counter[int]()
        for track in self.tracks:
            n_views = Counter(k for k, _ in track.members)
            at_once.update(k for k, n in n_views.items() if n >= min(3, len(self.names)) and not track.is_flat)
        counts = sorted(at_once.values(), reverse=True)
        return counts[min(self.every, len(counts)) - 1] if counts else 0

    def see(self, frame: int, pictures: Sequence[Image | None]) -> Seen:
        """Find the people of a frame, who become members of `tracks`.

        Args:
            frame: its number, larger than that of any before.
            pictures: of all views, (H, W, 3) RGB; None for one that is damaged.

        Returns:
            The figures of each view, in which the tracks have their indices.
        """
        figures: Seen = [[] for _ in pictures]
        known = [t for t in self.tracks if frame - t.seen <= self.every]
        for track in known:
            self._look_for(track, figures, pictures)
        is_time = self._last_search is None or frame - self._last_search >= self.every
        if is_time or not known or any(track.seen < frame - 1 for track in known):
            self._search(figures, pictures)
            self._last_search = frame
        self._follow(figures, frame)
        for track in self.tracks:
            if track.seen == frame:
                self._complete(track, frame, figures, pictures)
        return figures

    def mask(self, frame: int, view: int, figures: Sequence[DetectedPerson]) -> NDArray[np.uint8]:
        """Return the mask of a picture as footage has it, (H, W); see `tracker.footage.recording.read_mask`.

        People whom other views show at the same place are somebody. Unknown are figures whom no other view shows, and
        where somebody should be whom the detector does not see here.

        Args:
            frame: on which people were found last.
            view: index of the view.
            figures: of the picture, whose detector gives masks.
        """
        camera = self._views.cameras[view]
        width, height = camera.size
        out = np.zeros((height, width), np.uint8)
        here = [track for track in self.tracks if track.seen == frame and not track.is_flat]
        confirmed = {track.members[frame, view] for track in here if (frame, view) in track.members}
        for track in here:
            if (frame, view) not in track.members and (square := self._square(track, view)) is not None:
                center, radius = square.center_px.round().astype(int), round(square.side_px / 2)
                cv2.circle(out, tuple(map(int, center)), radius, UNKNOWN, cv2.FILLED)
        for i, figure in sorted(enumerate(figures), key=lambda at: at[0] in confirmed):
            if figure.mask is not None:
                out[figure.mask((height, width)) > 0.5] = ANYONE if i in confirmed else UNKNOWN
        return out

    def recall(self, observations: ObservationSet) -> dict[int, Seen]:
        """Take over the figures that were seen before, by frame, and follow the people among them."""
        points, out = observations.points, dict[int, Seen]()
        assert points is not None
        colors = np.full((*points.confidence.shape[:3], 6), np.nan) if points.colors is None else points.colors
        for k in observations.row_frames[0].astype(int).tolist():
            is_seen = points.is_known[k].any(axis=-1)
            out[k] = [
                [
                    DetectedPerson(points.points_px[k, v, i], points.confidence[k, v, i], 1.0, colors=colors[k, v, i])
                    for i in np.flatnonzero(own)
                ]
                for v, own in enumerate(is_seen)
            ]
            self._follow(out[k], k)
        return out

    def _follow(self, figures: Seen, frame: int) -> None:
        """Follow the people among the figures of a frame, and measure their legs."""
        follow_people(self._views, *self._undistorted(figures), frame, self.tracks)
        for track in self.tracks:
            if track.seen == frame:
                lengths = np.linalg.norm(np.diff(track.last_world[self._legs], axis=1), axis=-1).sum(axis=1)
                track.legs_m += lengths[np.isfinite(lengths)].tolist()

    def _look_for(self, track: PersonTrack, figures: Seen, pictures: Sequence[Image | None]) -> None:
        """Look for a person in all views, around the last place."""
        for v, picture in enumerate(pictures):
            square = self._square(track, v)
            if picture is not None and square is not None:
                self._add(figures[v], picture, square)

    def _complete(self, track: PersonTrack, frame: int, figures: Seen, pictures: Sequence[Image | None]) -> None:
        """Look for a person of this frame in the views that lack the person, where the others show one."""
        for v, picture in enumerate(pictures):
            if picture is None or (frame, v) in track.members or (square := self._square(track, v)) is None:
                continue
            before = len(figures[v])
            self._add(figures[v], picture, square)
            if len(figures[v]) == before:
                continue
            px, confidence = (values[v, before] for values in self._undistorted(figures))
            if track_distance(self._views, v, track.last_world, px, confidence) < SAME_PERSON_M:
                track.members[frame, v] = before

    def _search(self, figures: Seen, pictures: Sequence[Image | None]) -> None:
        """Look for people in whole pictures, and in their parts for small ones."""
        for v, picture in enumerate(pictures):
            if picture is None:
                continue
            for part in _parts(picture.shape[:2], _turn(self._up_px(v, self._middle))):
                for square in self._detector.find(picture, part):
                    if not any(self._is_around(square, figure) for figure in figures[v]):
                        self._add(figures[v], picture, square)

    def _add(self, figures: list[DetectedPerson], picture: Image, square: PictureSquare) -> None:
        """Keep the person of a square, unless it is one of the figures already."""
        found = self._detector.look(picture, square)
        if found is None:
            return
        for other in figures:
            apart = np.linalg.norm(found.points_px - other.points_px, axis=1)
            if np.nanmedian(apart) * ADULT.square_m < INLIER_M * square.side_px:
                return
        colors = clothes_colors(picture, found.points_px[self._torso], found.points_px[self._legs[:, 1]])
        figures.append(replace(found, colors=colors))

    def _is_around(self, square: PictureSquare, figure: DetectedPerson) -> bool:
        """Return whether a square is around the hips of a figure: others behind it are found by other views."""
        hips = figure.points_px[self._torso[2:]].mean(axis=0)
        return bool(np.linalg.norm(hips - square.center_px) * ADULT.square_m < 2 * INLIER_M * square.side_px)

    def _square(self, track: PersonTrack, view: int) -> PictureSquare | None:
        """Return the square of a view around the last place of a person; None where the view does not show it."""
        camera = self._views.cameras[view]
        torso = track.last_world[self._torso]
        hips, shoulders = torso[2:].mean(axis=0), torso[:2].mean(axis=0)
        (depth,) = camera.depths(hips[None])
        if not depth > NEAR_PLANE_M:
            return None
        center, chest = camera.distort_points(camera.project(np.array([hips, shoulders])))
        if not ((center >= 0) & (center < camera.size)).all():
            return None
        square_m = ADULT.square_m * float(np.median(track.legs_m or ADULT.leg_m)) / ADULT.leg_m
        side = square_m * self._views.focal_px[view] / depth
        # From above or below the trunk has no direction in the picture.
        is_along = np.hypot(*(chest - center)) > 0.1 * side
        return PictureSquare(center, side, _turn(chest - center if is_along else self._up_px(view, hips)))

    def _up_px(self, view: int, place_world: Array) -> Array:
        """Return the way that a point goes in a picture if it rises by 20 cm, (2,), undistorted px; NaN if unknown."""
        here, above = self._views.cameras[view].project(np.array([place_world, place_world + 0.2 * self._up]))
        return above - here

    def _undistorted(self, people: Seen) -> tuple[Array, Array]:
        """Return the points of all, (n_views, n_detections, n_points, 2), undistorted px, and confidences."""
        px, confidence = points_of(people, self._n_points)
        return self._views.undistorted(px[None])[0], confidence


def points_of(people: Seen, n_points: int, n_detections: int | None = None) -> tuple[Array, Array]:
    """Return the points of the people of a frame as arrays.

    Args:
        people: by view.
        n_points: of a person.
        n_detections: places for people in each view; as many as the most that one shows by default.

    Returns:
        Positions, (n_views, n_detections, n_points, 2), px of the pictures, NaN where absent; confidences, 0 there.
    """
    n = max(map(len, people)) if n_detections is None else n_detections
    px, confidence = np.full((len(people), n, n_points, 2), np.nan), np.zeros((len(people), n, n_points))
    for v, own in enumerate(people):
        for i, person in enumerate(own):
            px[v, i], confidence[v, i] = person.points_px, person.confidence
    return px, confidence


def _turn(up_px: Array) -> float:
    """Return the angle of a direction from the picture's upward one, clockwise, radians; 0 if it is unknown."""
    return float(np.arctan2(up_px[0], -up_px[1])) if np.isfinite(up_px).all() else 0.0


def _parts(shape: tuple[int, int], turn_rad: float) -> list[PictureSquare]:
    """Return squares that cover a picture: all of it, and half overlapping ones of its shorter side."""
    height, width = shape
    cosine, sine = abs(np.cos(turn_rad)), abs(np.sin(turn_rad))
    side = max(width * cosine + height * sine, height * cosine + width * sine)
    whole = PictureSquare(np.array([width / 2, height / 2]), side, turn_rad)
    side = min(height, width)
    places = [
        np.linspace(side / 2, length - side / 2, 1 + int(np.ceil(2 * (length - side) / side)))
        for length in (width, height)
    ]
    return [whole, *(PictureSquare(np.array([x, y]), side, turn_rad) for y in places[1] for x in places[0])]
