"""What a frame shows: per view the edges that poses are scored against, and their distance image."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker import silhouettes
from tracker.cameras import Camera
from tracker.edges import detect_edges
from tracker.recording import Recording, read_background, read_mask
from tracker.session import CameraSource
from tracker.silhouettes import Image

FloatArray = NDArray[np.float32]

SCENE_SPACING_PX = 3
"""Scene edges are thinned to one point per cell of this many pixels a side."""
MATCH_AREA_PX = 640 * 480
"""Frames are matched at a scale at which they have about this many pixels, and never enlarged."""
FOREGROUND_MARGIN = 0.012
"""How far around the silhouette edges are kept, as a fraction of the longer side of the image."""


@dataclass(frozen=True, eq=False)
class ViewEvidence:
    """The edges of one view, as they are matched."""

    camera: Camera
    """The view without lens distortion, at the scale of matching."""
    scale: float
    """Matched pixels per pixel of the footage, at most 1."""
    points_px: FloatArray
    """Edge points for the image-to-model direction, thinned, (N, 2), matched px."""
    distance: FloatArray
    """Distance to the nearest edge, cut off at the limit it was made with, (H, W), matched px."""


def default_theta_px(camera: Camera) -> float:
    """Distance beyond which an edge says nothing: 3% of the longer side of the image (20 px at 640x480)."""
    return 0.03 * max(camera.size)


def distance_image(edge_map: NDArray[np.bool_], limit_px: float) -> FloatArray:
    """Distance of each pixel to the nearest edge, `(H, W)` bool to `(H, W)` float32, cut off at the limit."""
    if not edge_map.any():
        return np.full(edge_map.shape, limit_px, np.float32)
    background = np.where(edge_map, 0, 255).astype(np.uint8)
    distance = cv2.distanceTransform(background, cv2.DIST_L2, cv2.DIST_MASK_5)
    return np.minimum(distance, np.float32(limit_px))


def view_evidence(camera: Camera, scale: float, edge_map: NDArray[np.bool_]) -> ViewEvidence:
    """Make the evidence of a view from its edge map.

    Args:
        camera: the view without lens distortion at the scale of the edge map.
        scale: pixels of the edge map per pixel of the footage.
        edge_map: (H, W) bool.
    """
    assert edge_map.shape == (camera.height, camera.width), (edge_map.shape, camera.size)
    v, u = np.nonzero(edge_map)
    cells = (v // SCENE_SPACING_PX) * camera.width + u // SCENE_SPACING_PX
    _, first = np.unique(cells, return_index=True)
    points = np.stack([u[first], v[first]], axis=-1).astype(np.float32)
    # Beyond twice theta nothing asks for the distance any more.
    return ViewEvidence(camera, scale, points, distance_image(edge_map, 2 * default_theta_px(camera)))


def match_scale(camera: Camera) -> float:
    """Scale at which the frames of a camera are matched: 1 up to 640x480, smaller above."""
    return min(1.0, float(np.sqrt(MATCH_AREA_PX / (camera.width * camera.height))))


class Observer:
    """Turns the frames of a recording into evidence. Safe to use from several threads."""

    def __init__(self, cameras: Sequence[CameraSource], recording: Recording) -> None:
        """Read the backgrounds.

        Args:
            cameras: the views, with their side files.
            recording: their footage.

        Raises:
            RecordingError: a background is missing, unreadable or of the wrong size.
        """
        self.cameras = tuple(cameras)
        self._recording = recording
        self._scales = [match_scale(c.camera) for c in cameras]
        self._matched = [c.camera.pinhole.scaled(s) for c, s in zip(cameras, self._scales, strict=True)]
        self._backgrounds = [
            None if image is None else _matched(source.camera, matched, image)
            for source, matched, image in zip(cameras, self._matched, map(read_background, self.cameras), strict=True)
        ]

    def images(self, k: int) -> tuple[Image | None, ...]:
        """Frame k of each camera in undistorted pixels, (H, W, 3) RGB; None where it is damaged."""
        return tuple(
            None if image is None else source.camera.undistort_image(image)
            for source, image in zip(self.cameras, self._recording.read(k), strict=True)
        )

    def evidence(self, k: int) -> tuple[ViewEvidence, ...]:
        """The edges of frame k in each view, kept to the foreground where masks or a background tell it.

        A damaged frame has no edges: the view has no say in the cost.
        """
        frames = self._recording.read(k)
        return tuple(self._observe(i, image, k) for i, image in enumerate(frames))

    def _observe(self, i: int, image: Image | None, k: int) -> ViewEvidence:
        source, matched = self.cameras[i], self._matched[i]
        if image is None:
            return view_evidence(matched, self._scales[i], np.zeros((matched.height, matched.width), dtype=bool))
        frame = _matched(source.camera, matched, image)
        mask, background, foreground = read_mask(source, k), self._backgrounds[i], None
        if mask is not None:
            undistorted = source.camera.undistort_image(mask, nearest=True)
            foreground = cv2.resize(undistorted, matched.size, interpolation=cv2.INTER_NEAREST) > 0
        elif background is not None:
            foreground = silhouettes.subtract_background(frame, background)
        if foreground is not None:
            foreground = silhouettes.grow(foreground, FOREGROUND_MARGIN * max(matched.size))
        return view_evidence(matched, self._scales[i], detect_edges(frame, foreground))


def _matched(camera: Camera, matched: Camera, image: Image) -> Image:
    """Undistort an image as filmed and bring it to the scale of matching."""
    undistorted = camera.undistort_image(image)
    if matched.size == camera.size:
        return undistorted
    return np.asarray(cv2.resize(undistorted, matched.size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
