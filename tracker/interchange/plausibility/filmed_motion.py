"""Compare the motion of people in space with that of the pictures, by optical flow.

The flow of a picture shows when a limb moved, also of people who move little and whose silhouettes hardly change.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.evidence.images.working_view import MIN_REGION_PX
from tracker.geometry.arrays import Array, Image, IntArray
from tracker.geometry.cameras import Camera
from tracker.interchange.plausibility.body_likelihood import Places

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
        ends = [(places[a], places[b]) for s in ("left", "right") for a, b in _named(s) if places.keys() >= {a, b}]
        lags = np.arange(-most * self.step, most * self.step + 1)
        if not ends:
            return np.empty((len(lags), 0, 0))
        points = np.stack([[a, (a + b) / 2, b] for a, b in ends])
        errors = [self._of_view(v, np.moveaxis(points, 2, 0), lags) for v in range(len(self.cameras))]
        return np.concatenate(errors, axis=-1)

    def _of_view(self, view: int, points: Array, lags: IntArray) -> Array:
        """Return the errors of a view, (n_lags, F - n_steps, n_bones), from points, (F, n_bones, 3, 3), metres."""
        camera, flow = self.cameras[view], self.flows[view]
        flat = points.reshape(-1, 3)
        px = camera.project(flat).reshape(*points.shape[:3], 2)
        metres = (camera.depths(flat) / camera.K[0, 0]).reshape(px.shape[:3])[:-1]
        with np.errstate(invalid="ignore"):
            inside = np.all((px > -0.5) & (px < np.array(camera.size) - 0.5), axis=-1)[:-1] & (metres > 0)
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


def _named(side: str) -> list[tuple[str, str]]:
    return [(f"{side}_{a}", f"{side}_{b}") for a, b in _BONES]
