"""The people of a recording, frame after frame, by a detector that sees one picture at a time.

Views know more together than each alone: where a person stands, and with which side up. A person is therefore sought in
every view around the place that the other views and the frame before show, and with the feet where the floor is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from tracker.detection.detector import SQUARE_M, DetectedPerson, Detector, PictureSquare
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera, viewed_point
from tracker.observations.identities import SAME_PERSON_M, PersonTrack, follow_people, track_distance
from tracker.observations.observed import ObservationSet
from tracker.observations.triangulation import INLIER_M, Views

_TORSO = ("left_shoulder", "right_shoulder", "left_hip", "right_hip")
_FIND_EVERY_S = 0.5
"""Time between two searches of whole pictures for people who enter, seconds: someone walks 0.7 m meanwhile. A person
who is lost is sought at the last place until then."""

Seen: TypeAlias = list[list[DetectedPerson]]
"""The people whom each view sees on a frame."""


class PeopleInViews:
    """Finds people in the pictures of all cameras, and follows them."""

    def __init__(
        self, detector: Detector, body_points: Mapping[str, int], cameras: Sequence[Camera], up: Array, fps: float
    ) -> None:
        """Begin with nobody.

        Args:
            detector: sees a picture.
            body_points: index of the detector's point for points of the body, those of the torso among them.
            cameras: of all views.
            up: unit vector that points up, (3,), world.
            fps: frames per second.
        """
        self._detector, self._views, self._up = detector, Views(cameras), up
        self._torso = [body_points[name] for name in _TORSO]
        self._every = max(1, round(_FIND_EVERY_S * fps))
        self._middle = viewed_point(cameras)
        self._last_search: int | None = None
        self.tracks: list[PersonTrack] = []

    def see(self, frame: int, pictures: Sequence[Image | None]) -> Seen:
        """Find the people of a frame, who become members of `tracks`.

        Args:
            frame: its number, larger than that of any before.
            pictures: of all views, (H, W, 3) RGB; None for one that is damaged.

        Returns:
            The figures of each view, in which the tracks have their indices.
        """
        figures: Seen = [[] for _ in pictures]
        known = [t for t in self.tracks if frame - t.seen <= self._every]
        for track in known:
            self._look_for(track, figures, pictures)
        is_time = self._last_search is None or frame - self._last_search >= self._every
        if is_time or not known or any(track.seen < frame - 1 for track in known):
            self._search(figures, pictures)
            self._last_search = frame
        follow_people(self._views, *self._arrays(figures), frame, self.tracks)
        for track in self.tracks:
            if track.seen == frame:
                self._complete(track, frame, figures, pictures)
        return figures

    def recall(self, observations: ObservationSet) -> dict[int, Seen]:
        """Take over the figures that were seen before, by frame, and follow the people among them."""
        points, out = observations.points, dict[int, Seen]()
        assert points is not None
        for k in observations.row_frames[0].astype(int).tolist():
            is_seen = points.is_known[k].any(axis=-1)
            out[k] = [
                [
                    DetectedPerson(points.points_px[k, v, i], points.confidence[k, v, i], 1.0)
                    for i in np.flatnonzero(own)
                ]
                for v, own in enumerate(is_seen)
            ]
            follow_people(self._views, *self._arrays(out[k]), k, self.tracks)
        return out

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
            px, confidence = self._undistorted(v, figures[v][-1])
            if track_distance(self._views, v, track.last_world, px, confidence) < SAME_PERSON_M:
                track.members[frame, v] = before

    def _search(self, figures: Seen, pictures: Sequence[Image | None]) -> None:
        """Look for people in whole pictures, and in their parts for small ones."""
        for v, picture in enumerate(pictures):
            if picture is None:
                continue
            turn = self._turn(v, self._middle)
            for part in _parts(picture.shape[:2], turn):
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
            if np.nanmedian(apart) * SQUARE_M < INLIER_M * square.side_px:
                return
        figures.append(replace(found, mask=None))  # masks of all frames would fill the memory

    def _is_around(self, square: PictureSquare, figure: DetectedPerson) -> bool:
        """Return whether a square is around the hips of a figure: others behind it are found by other views."""
        hips = figure.points_px[self._torso[2:]].mean(axis=0)
        return bool(np.linalg.norm(hips - square.center_px) * SQUARE_M < 2 * INLIER_M * square.side_px)

    def _square(self, track: PersonTrack, view: int) -> PictureSquare | None:
        """Return the square of a view around the last place of a person; None where the view does not show it."""
        camera = self._views.cameras[view]
        torso = track.last_world[self._torso]
        hips, shoulders = torso[2:].mean(axis=0), torso[:2].mean(axis=0)
        depth = float(camera.depths(hips[None])[0])
        if not np.isfinite(depth) or depth < 0.1:
            return None
        center, above = camera.distort_points(camera.project(np.array([hips, hips + 0.1 * self._up])))
        if not np.isfinite(center).all() or not (0 <= center[0] < camera.width and 0 <= center[1] < camera.height):
            return None
        side = SQUARE_M * self._views.focal_px[view] / depth
        axis = camera.distort_points(camera.project(shoulders[None]))[0] - center
        # From above or below the trunk has no direction in the picture.
        up = axis if np.isfinite(axis).all() and np.hypot(*axis) > 0.1 * side else above - center
        return PictureSquare(center, side, float(np.arctan2(up[0], -up[1])))

    def _turn(self, view: int, place_world: Array) -> float:
        """Return the angle of the up direction in a picture, radians."""
        camera = self._views.cameras[view]
        a, b = camera.project(np.array([place_world, place_world + 0.2 * self._up]))
        up = b - a
        return float(np.arctan2(up[0], -up[1])) if np.isfinite(up).all() else 0.0

    def _undistorted(self, view: int, figure: DetectedPerson) -> tuple[Array, Array]:
        px = np.full((1, len(self._views.cameras), *figure.points_px.shape), np.nan)
        px[0, view] = figure.points_px
        return self._views.undistorted(px)[0, view], figure.confidence

    def _arrays(self, figures: Sequence[Sequence[DetectedPerson]]) -> tuple[Array, Array]:
        """Return the points of all figures, (n_views, n_detections, n_points, 2), undistorted px, and confidences."""
        return figure_arrays(self._views, figures)


def figure_arrays(views: Views, figures: Sequence[Sequence[DetectedPerson]]) -> tuple[Array, Array]:
    """Return points, (n_views, n_detections, n_points, 2), undistorted px, and confidences of the same shape but 2."""
    n = max((len(own) for own in figures), default=0)
    n_points = next((len(f.confidence) for own in figures for f in own), 0)
    px, confidence = np.full((len(figures), n, n_points, 2), np.nan), np.zeros((len(figures), n, n_points))
    for v, own in enumerate(figures):
        for i, figure in enumerate(own):
            px[v, i], confidence[v, i] = figure.points_px, figure.confidence
    return views.undistorted(px[None])[0] if n else px, confidence


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
