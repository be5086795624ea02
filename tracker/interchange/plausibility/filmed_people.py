"""Compare points of people in space with the silhouettes of the people who were filmed, and their motion with the flow.

The flow of a picture shows when a limb moved, also of people who move little and whose silhouettes hardly change.
"""

from collections import deque
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.errors import TrackerError
from tracker.evidence.images.working_view import MIN_REGION_PX
from tracker.evidence.silhouettes import SilhouetteFinder, ViewSilhouette
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array, Image, IntArray, Mask
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.same_place import INLIER_M
from tracker.interchange.plausibility.body_likelihood import Places
from tracker.session.session import Session

_BONES = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
"""Joints at the ends of the parts that move."""


@dataclass(frozen=True, eq=False)
class FilmedMotion:
    """How the pictures of some cameras move."""

    cameras: tuple[Camera, ...]
    """Camera of the pixels of each view, with its lens distortion."""
    flows: tuple[NDArray[np.float16], ...]
    """By view, from each picture to that `step` frames later, (n, rows, columns, 2), px; NaN where unknown."""
    step: int
    """Frames of the session from a place of a person to the next."""
    n_steps: int = 3
    """Steps over which motions are compared: 0.1 s in which a limb moves more than the points of a network tremble."""
    cell_px: int = 4
    """Spacing of the rows and columns of flows, px: that of OpenCV's finest level (`DISOpticalFlow`, ultrafast)."""

    def errors_m(self, places: Places, most: int) -> Array:
        """Return how far limbs move otherwise than the pictures of other frames, metres.

        The shape is (2 most * step + 1, F - n_steps, n_views * n_bones).

        Args:
            places: of one person, (F, 3) each, metres.
            most: largest lag of the pictures, in steps; those of lag 0 are in the middle.
        """
        limbs, lags = _limbs(places, _BONES), np.arange(-most * self.step, most * self.step + 1)
        if not limbs:
            return np.empty((len(lags), 0, 0))
        points = np.moveaxis(np.stack(limbs), 2, 0)
        errors = [self._of_view(v, points, lags) for v in range(len(self.cameras))]
        return np.concatenate(errors, axis=-1)

    def _of_view(self, view: int, points: Array, lags: IntArray) -> Array:
        """Return the errors of a view, (n_lags, F - n_steps, n_bones), from points, (F, n_bones, 3, 3), metres."""
        camera, flow = self.cameras[view], self.flows[view]
        px, depths, is_shown = _projected(camera, points)
        metres = (depths / camera.K[0, 0])[:-1]
        inside = is_shown[:-1] & (metres > 0)
        u, v = np.moveaxis(np.where(inside[..., None], px[:-1], 0.0).round().astype(np.int64) // self.cell_px, -1, 0)
        moved, apart_m = np.diff(px, axis=0), np.full((len(lags), *inside.shape, 2), np.nan)
        for row, lag in enumerate(lags):
            shown = self.step * np.arange(len(inside)) + lag
            rows = (shown >= 0) & (shown < len(flow))
            seen = flow[shown[rows, None, None], v[rows], u[rows]]
            apart_m[row, rows] = np.where(inside[rows], metres[rows], np.nan)[..., None] * (seen - moved[rows])
        n = max(0, len(inside) - self.n_steps + 1)
        sums = np.sum([apart_m[:, i : i + n] for i in range(self.n_steps)], axis=0)
        return np.asarray(np.linalg.norm(sums, axis=-1).mean(axis=-1))


class MotionFinder:
    """Finds the flow of the pictures of a recording, one frame after the other."""

    def __init__(self, step: int) -> None:
        """Remember how many frames lie between the pictures that are compared."""
        self.step = step
        self._before = deque[list[Image | None]](maxlen=step)
        self._flows: list[list[NDArray[np.float16]]] = []
        self._finder = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)

    def add(self, frames: Sequence[Image | None], cameras: Sequence[Camera]) -> None:
        """Take the next frame of each camera, RGB, at the size of cameras; None if it is damaged."""
        pictures = [None if f is None else _grey(f, c) for f, c in zip(frames, cameras, strict=True)]
        if len(self._before) == self.step:
            pairs = zip(self._before[0], pictures, cameras, strict=True)
            self._flows.append([self._flow(before, after, c) for before, after, c in pairs])
        self._before.append(pictures)

    def motion(self, cameras: Sequence[Camera]) -> FilmedMotion | None:
        """Return the motion of all pictures; None of a single one."""
        if not self._flows:
            return None
        return FilmedMotion(tuple(cameras), tuple(np.stack(f) for f in zip(*self._flows, strict=True)), self.step)

    def _flow(self, before: Image | None, after: Image | None, camera: Camera) -> NDArray[np.float16]:
        flow = np.full((camera.height, camera.width, 2), np.nan, np.float32)
        if before is not None and after is not None and min(camera.size) >= MIN_REGION_PX:
            self._finder.calc(before, after, np.nan_to_num(flow, copy=False))
        return flow[:: FilmedMotion.cell_px, :: FilmedMotion.cell_px].astype(np.float16)


def _grey(frame: Image, camera: Camera) -> Image:
    grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
    return np.asarray(cv2.resize(grey, camera.size, interpolation=cv2.INTER_AREA), np.uint8)


_BELOW = (("elbow", "wrist"), ("knee", "ankle"))
"""Joints of the parts that move most."""


@dataclass(frozen=True, eq=False)
class FilmedPeople:
    """Distances from the silhouettes of the people in some frames."""

    cameras: tuple[Camera, ...]
    """Camera of the pixels of each view, with its lens distortion."""
    distances_px: tuple[NDArray[np.uint8], ...]
    """By view, the distance of each pixel from the silhouettes, (F, height, width), whole px, at most 255."""
    shows_people: Mask
    """Whether a view shows anybody, (F, n_views)."""
    motion: FilmedMotion | None = None
    """How the pictures move; None where that is unknown."""
    knows_frames: bool = True
    """Whether they are those of footage; else people may be anywhere in the pictures."""
    is_whole: bool = True
    """Whether silhouettes show people whole: against the median of a recording, only what moves is seen."""

    @property
    def certain(self) -> "FilmedPeople":
        """Places where people must be: silhouettes that are whole, else anywhere in the pictures."""
        return self if self.is_whole else _anywhere(self.cameras, len(self.shows_people))

    @property
    def n_views(self) -> int:
        """Number of views, each of which shows the limbs."""
        return len(self.cameras)

    def lag_errors_m(self, places: Places, most: int) -> list[Array]:
        """Return how far limbs move beside the pictures of other frames, and how far they are from their silhouettes.

        See `readings.KnownPeople` and `FilmedMotion.errors_m`. A pixel is the least distance from a silhouette.
        """
        points, lags = _limb_points(places), range(-most, most + 1)
        views = range(len(self.cameras))
        apart = [np.concatenate([self._away_m(v, points, lag, 1) for v in views], axis=-1) for lag in lags]
        return [*([] if self.motion is None else [self.motion.errors_m(places, most)]), np.stack(apart)]

    def costs(self, places: Places) -> Array:
        """Return how far limbs lie outside of the silhouettes, (F,): mean truncated squares, 0 to 1; NaN if unknown.

        A point that fewer than two views show, or than there are, counts as far outside.

        Args:
            places: of one person on the frames, metres.
        """
        points = _limb_points(places)
        known = np.isfinite(points).all(axis=-1)
        away_m = np.stack([self._away_m(v, points) for v in range(len(self.cameras))])
        squares = np.minimum(away_m / INLIER_M, 1.0) ** 2
        n_seen, n_views = np.isfinite(squares).sum(axis=0), self.shows_people.sum(axis=1)[:, None]
        of_points = np.where(n_seen >= np.minimum(2, n_views), np.nansum(squares, axis=0) / np.maximum(n_seen, 1), 1.0)
        n_known = known.sum(axis=1)
        out = np.where(known, of_points, 0.0).sum(axis=1) / np.maximum(n_known, 1)
        return np.where((n_known > 0) & (n_views[:, 0] > 0), out, np.nan)

    def _away_m(self, view: int, points: Array, lag: int = 0, least_px: int = 0) -> Array:
        """Return the distances of points from the silhouettes of a view, (F, n), metres; NaN where it shows neither.

        Args:
            view: its index.
            points: (F, n, 3), metres.
            lag: rows by which the silhouettes are later.
            least_px: least distance, px.
        """
        camera, distances = self.cameras[view], self.distances_px[view]
        px, depths, inside = _projected(camera, points)
        shown = np.arange(len(points)) + lag
        is_row = (shown >= 0) & (shown < len(distances))
        shown = np.where(is_row, shown, 0)
        inside = inside & (depths > NEAR_PLANE_M) & (is_row & self.shows_people[shown, view])[:, None]
        u, v = np.moveaxis(np.round(np.where(inside[..., None], px, 0.0)).astype(np.int64), -1, 0)
        away_px = np.maximum(distances[shown[:, None], v, u], least_px)
        return np.where(inside, away_px * depths / camera.K[0, 0], np.nan)


def segment_filmed_people(session: Session, frames: IntArray) -> FilmedPeople:
    """Find the people of some frames by the session's masks, backgrounds, or its own median, and their motion.

    Without readable footage, people may be anywhere in the pictures.

    Args:
        session: its cameras and footage.
        frames: at equal steps, (F,).
    """
    unknown = _anywhere(tuple(c.camera for c in session.cameras), len(frames))
    if not len(frames) or not all(c.footage.exists() for c in session.cameras):
        return unknown
    try:
        with Recording(session.cameras) as recording, closing(SilhouetteFinder(session.cameras, recording)) as finder:
            return _filmed(recording, finder, frames)
    except TrackerError:  # the footage has its own messages
        return unknown


def _filmed(recording: Recording, finder: SilhouetteFinder, frames: IntArray) -> FilmedPeople:
    step = int(frames[1] - frames[0]) if len(frames) > 1 else 1
    found, motion = list[tuple[ViewSilhouette, ...]](), MotionFinder(step)
    for k in range(int(frames[0]), int(frames[-1]) + 1):
        if (k - frames[0]) % step == 0:
            found.append(finder.silhouettes(k))
        shown = [c.clock.nearest(k, recording.n_frames) for c in finder.cameras]
        motion.add(recording.read_each(shown), [s.camera for s in found[0]])
    cameras = tuple(s.camera for s in found[0])
    distances = tuple(np.stack([_distances(s.mask) for s in of_view]) for of_view in zip(*found, strict=True))
    shows = np.array([[not s.is_empty for s in views] for views in found])
    is_whole = all(s.source != "recording" for views in found for s in views)
    return FilmedPeople(cameras, distances, shows, motion.motion(cameras), is_whole=is_whole)


def _anywhere(cameras: tuple[Camera, ...], n_frames: int) -> FilmedPeople:
    distances = tuple(np.broadcast_to(np.uint8(0), (n_frames, c.height, c.width)) for c in cameras)
    return FilmedPeople(cameras, distances, np.ones((n_frames, len(cameras)), dtype=bool), knows_frames=False)


def _distances(mask: Mask) -> NDArray[np.uint8]:
    found = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 3)
    return np.minimum(np.round(found), 255).astype(np.uint8)


def _limb_points(places: Places) -> Array:
    """Return the joints of forearms and calves and their middles, (F, n, 3); without these all points."""
    limbs = _limbs(places, _BELOW)
    return np.stack([point for limb in limbs for point in limb] or [*places.values()], axis=1)


def _limbs(places: Places, joints: Sequence[tuple[str, str]]) -> list[tuple[Array, Array, Array]]:
    """Return one end, the middle and the other end, (F, 3) each, of the parts between joints of both sides."""
    ends = [(f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in joints]
    return [(places[a], (places[a] + places[b]) / 2, places[b]) for a, b in ends if places.keys() >= {a, b}]


def _projected(camera: Camera, points: Array) -> tuple[Array, Array, Mask]:
    """Return the pixels, (..., 2), and the depths of points, (..., 3), metres, and which pixels are of the picture."""
    flat = points.reshape(-1, 3)
    px, depths = camera.project(flat).reshape(*points.shape[:-1], 2), camera.depths(flat).reshape(points.shape[:-1])
    with np.errstate(invalid="ignore"):
        return px, depths, np.all((px > -0.5) & (px < np.array(camera.size) - 0.5), axis=-1)
