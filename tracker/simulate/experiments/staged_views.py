"""Synthetic evidence: the contours of a posed body, or of a skinned person, in cameras that film nothing else."""

from collections.abc import Sequence
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.label_image import part_labels
from tracker.evidence.images.distance_transform import distance_image
from tracker.evidence.images.silhouette_contour import trace_silhouette
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import Silhouette, ViewEvidence, default_theta_px, thin_points
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import Camera
from tracker.simulate.people.skin import Skin
from tracker.simulate.stage.rasterizer import cast

_STEP_PX = 0.5
"""Distance of neighbouring points on a drawn contour, px."""
_DEPTH_STEP = 0.015
"""Smallest relative change of depth from a pixel to the next across an occluding contour: 6 cm at 4 m."""


class Actor(Protocol):
    """Something that shows contours in a pose."""

    def contours(self, pose: Array, camera: Camera) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return points on the visible contours (N, 2), px, unit normals there (N, 2), and the silhouette (H, W)."""


class ModelActor:
    """The fitted model itself, as in KRH08 Sect. 6: its own extremal contours."""

    def __init__(self, model: BodyModel) -> None:
        """Take the body."""
        self._model = model

    def contours(self, pose: Array, camera: Camera) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """See `Actor`."""
        body = PosedBody(self._model, pose)
        seen = occluding_contours.trace([body], camera)
        ends = seen.pieces_px[~seen.occluded].astype(np.float64)
        steps = ends[:, 2:] - ends[:, :2]
        lengths = np.linalg.norm(steps, axis=1)
        counts = np.maximum(np.ceil(lengths / _STEP_PX).astype(int), 1)
        pieces = np.repeat(np.arange(len(ends)), counts)
        share = (np.arange(len(pieces)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[pieces]
        points = ends[pieces, :2] + share[:, None] * steps[pieces]
        normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.maximum(lengths, 1e-9)[:, None]
        silhouette = part_labels([body], camera) > 0
        return points.astype(np.float32), normals[pieces].astype(np.float32), silhouette


class SkinActor:
    """A skinned person of another shape than the fitted model: contours where the depth has a step."""

    def __init__(self, skin: Skin) -> None:
        """Take the person."""
        self._skin = skin

    def contours(self, pose: Array, camera: Camera) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """See `Actor`."""
        inverse = cast(camera, self._skin.posed(pose), self._skin.faces).inverse_depths
        silhouette = inverse > 0
        # The contour is on the nearer side of a step.
        near = inverse.max() * 0.5
        padded = np.pad(inverse, 1, mode="edge")
        lowest = np.minimum.reduce([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        found = silhouette & (inverse - lowest > _DEPTH_STEP * np.maximum(inverse, near))
        rows, columns = np.nonzero(found)
        soft = cv2.GaussianBlur(inverse, (0, 0), 1.5)
        slope = np.stack([cv2.Sobel(soft, cv2.CV_32F, 1, 0), cv2.Sobel(soft, cv2.CV_32F, 0, 1)], axis=-1)[rows, columns]
        normals = -slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)
        # The middle of the outermost pixel is half a pixel within the contour.
        points = np.stack([columns, rows], axis=1) + 0.5 * normals
        return points.astype(np.float32), normals.astype(np.float32), silhouette


class StagedObserver(Observer):
    """An observer of a synthetic recording. Every view is whole, and every contour is an edge."""

    def __init__(
        self, actor: Actor, poses: Array, cameras: Sequence[Camera], noise_px: float = 0.0, seed: int = 0
    ) -> None:
        """Stage a motion.

        Args:
            actor: who moves.
            poses: true poses, (n_frames, n_values) of the actor.
            cameras: the views, without lens distortion.
            noise_px: standard deviation of contour points across the contour, px.
            seed: of the noise.
        """
        self._actor, self._poses, self._cameras = actor, poses, tuple(c.pinhole for c in cameras)
        self._noise_px, self._seed = noise_px, seed
        self._known: tuple[int, tuple[ViewEvidence, ...]] = (-1, ())

    @property
    def working_cameras(self) -> tuple[Camera, ...]:
        """See `Observer.working_cameras`."""
        return self._cameras

    def ahead_frames(self, k: int) -> tuple[float, ...]:
        """Return 0 for each view: all pictures are of the time of the frame."""
        return (0.0,) * len(self._cameras)

    def prefetch(self, k: int, *_: Any, **__: Any) -> None:
        """Do nothing: there is no footage to decode."""

    def evidence(self, k: int, *_: Any, **__: Any) -> tuple[ViewEvidence, ...]:
        """Return the evidence of frame k in each view: all contours, whatever is predicted."""
        if self._known[0] != k:
            self._known = (k, tuple(self._view(k, i) for i in range(len(self._cameras))))
        return self._known[1]

    def _view(self, k: int, view: int) -> ViewEvidence:
        camera = self._cameras[view]
        points, normals, silhouette = self._actor.contours(self._poses[k], camera)
        if self._noise_px:
            rng = np.random.default_rng([self._seed, k, view])
            shifts = (self._noise_px * rng.standard_normal(len(points))).astype(np.float32)
            points = points + shifts[:, None] * normals
        inside = np.all((points > 0) & (points < np.array(camera.size) - 1), axis=1)
        points, normals = points[inside], normals[inside]
        found = np.zeros((camera.height, camera.width), np.uint8)
        columns, rows = np.rint(points).astype(np.intp).T
        found[rows, columns] = 1
        first = thin_points(points, camera.height, camera.width)
        limit_px = 2 * default_theta_px(camera.size)
        contour = trace_silhouette(silhouette)
        kept = thin_points(contour.points_px, camera.height, camera.width)
        return ViewEvidence(
            camera, 1.0, points[first], distance_image(found, limit_px), normals=normals[first],
            silhouette=Silhouette(silhouette, contour.points_px[kept], contour.normals[kept], 1.0, contour, limit_px),
        )  # fmt: skip
