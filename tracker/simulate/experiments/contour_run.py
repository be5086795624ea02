"""Track one synthetic recording, and compare the poses with the truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.observability import ContourNoise, observe_pose
from tracker.estimation.tracking.tracker import Subjects, TrackerSettings, TrackingRun
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import PIECE_PX
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.pipeline.methods import make_tracker
from tracker.simulate.experiments.staged_views import Actor, StagedObserver

OBSERVABLE_DEG = 2.0
"""Standard deviation at the true pose, with 1 px of noise, below which an angle counts as observable, degrees."""
EXACT_1PX = ContourNoise(1.0, PIECE_PX, 0.0)
"""Noise of 1 px, independent from piece to piece, on the contours of the very body that is fitted."""
LOST_DEG = 3.0
"""Mean error of the angles of a frame above which it counts as lost, degrees."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A synthetic recording with its truth, and the body that is fitted to it."""

    actor: Actor
    truth: Array
    """True poses, (n_frames, n_values), of the fitted body's degrees of freedom."""
    model: BodyModel
    """The fitted body."""
    cameras: tuple[Camera, ...]
    fps: float
    noise_px: float = 0.0
    """Noise of the contours, px."""


class RunResult(NamedTuple):
    """What a tracker reached on a scene."""

    poses: Array
    """Estimated poses, (n_frames, n_values)."""
    errors: Array
    """Estimate less truth, (n_frames, n_dofs), rad and metres."""
    observable: NDArray[np.bool_]
    """Which angles the views determine at the true pose, (n_frames, n_dofs)."""
    before_px: Array
    """RMS distance of the contours to the image contours with the pose of the frame before, (n_frames,), px."""
    after_px: Array
    """The same with the estimate, (n_frames,), px."""
    true_px: Array
    """The same with the true pose, (n_frames,), px: what pixels and other shapes leave."""

    @property
    def frame_errors(self) -> Array:
        """Mean error of the observable angles of each frame, (n_frames,), rad; NaN where none is observable."""
        counts = self.observable.sum(axis=1)
        total = np.where(self.observable, np.abs(self.errors), 0.0).sum(axis=1)
        return np.divide(total, counts, out=np.full(len(counts), np.nan), where=counts > 0)

    @property
    def mean_error(self) -> float:
        """Mean error of the observable angles of all frames, rad; NaN where none is observable."""
        return float(np.abs(self.errors)[self.observable].mean()) if self.observable.any() else np.nan

    @property
    def lost_frames(self) -> int:
        """Number of frames whose mean error is above `LOST_DEG`."""
        return int(np.sum(self.frame_errors > np.radians(LOST_DEG)))


def track_scene(scene: Scene, settings: TrackerSettings, seed: int = 0) -> RunResult:
    """Track a scene from the true pose of its first frame.

    Args:
        scene: the recording.
        settings: of any tracking method.
        seed: of the noise.
    """
    observer = StagedObserver(scene.actor, scene.truth, scene.cameras, scene.noise_px, seed)
    model, frames = scene.model, range(len(scene.truth))
    run = TrackingRun(observer, Subjects.of([model]), [scene.truth[0]], frames, scene.fps)
    poses, px = list[Array](), list[list[float]]()
    for k, found in enumerate(make_tracker(settings).estimates(run)):
        poses.append(found.poses[0])
        views = observer.evidence(k)  # at once, while it is cached: a skinned person takes long to draw
        px.append(
            [contour_rms_px(views, PosedBody(model, p)) for p in (poses[max(k - 1, 0)], poses[k], scene.truth[k])]
        )
    errors = np.array([model.difference(p, t) for p, t in zip(poses, scene.truth, strict=True)])
    return RunResult(np.array(poses), _unwrapped(model, errors), observable_angles(scene), *np.array(px).T)


def observable_angles(scene: Scene) -> NDArray[np.bool_]:
    """Return which angles the views determine, (n_frames, n_dofs), decided at the truth before anything is fitted."""
    model = scene.model
    sigmas = [observe_pose([PosedBody(model, pose)], scene.cameras, noise=EXACT_1PX).sigmas for pose in scene.truth]
    return (np.array(sigmas) < np.radians(OBSERVABLE_DEG)) & ~model.dof_is_length


def contour_rms_px(views: Sequence[ViewEvidence], body: PosedBody) -> float:
    """Return the RMS distance of a body's visible contours to the image contours, over all views, px.

    Distances are those of the distance images, which end at twice the outlier distance; the mean is over the length of
    the contour within the images. NaN where nothing is visible.
    """
    total = length = 0.0
    for view in views:
        seen = occluding_contours.trace([body], view.camera)
        ends = seen.pieces_px[~seen.occluded].astype(np.float64)
        middles = np.rint((ends[:, :2] + ends[:, 2:]) / 2).astype(int)
        inside = np.all((middles >= 0) & (middles < np.array(view.camera.size)), axis=1)
        lengths = np.linalg.norm(ends[:, 2:] - ends[:, :2], axis=1)[inside]
        distances = view.distance[middles[inside, 1], middles[inside, 0]]
        total += float(np.sum(lengths * distances**2))
        length += float(lengths.sum())
    return float(np.sqrt(total / length)) if length else np.nan


def _unwrapped(model: BodyModel, errors: Array) -> Array:
    """Bring the errors of angles to (-pi, pi]."""
    turns = np.round(errors / (2 * np.pi)) * 2 * np.pi
    return errors - np.where(model.dof_is_length, 0.0, turns)
