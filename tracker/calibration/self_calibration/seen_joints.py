"""Joints of people in the pictures of all cameras, as observations of free points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.calibration.check.rig_adjustment import Observations
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.robust_triangulation import Views
from tracker.interchange.observations.observed import ObservationSet, side_pairs
from tracker.interchange.observations.sides import exchanged_sides, with_sides_exchanged


@dataclass(frozen=True, eq=False)
class SeenJoints:
    """Joints of people in the pictures of all cameras. Column j on the k-th frame is point k * n_joints + j."""

    names: tuple[str, ...]
    """Point of the body that each joint of a person is, (J,); empty for one that the body lacks, such as an eye."""
    px: Array
    """Original pixels, (F, V, N, 2). Joint j of person p is column p * J + j of N."""
    is_seen: Mask
    """Whether a camera shows a joint, (F, V, N)."""
    n_people: int = 1
    """Number of people."""

    @property
    def n_joints(self) -> int:
        """Number of joints of all people, N."""
        return self.n_people * len(self.names)

    def on_frames(self, frames: IntArray | Mask) -> "SeenJoints":
        """Return the joints on some frames."""
        return replace(self, px=self.px[frames], is_seen=self.is_seen[frames])

    def with_more(self, others: "SeenJoints") -> "SeenJoints":
        """Return the joints of a person with others on the same frames."""
        px = np.concatenate([self.px, others.px], axis=2)
        return SeenJoints(self.names + others.names, px, np.concatenate([self.is_seen, others.is_seen], axis=2))

    def observations(self, cameras: Sequence[int] | None = None) -> Observations:
        """Return the joints that at least two of some cameras show, which are numbered as they are given."""
        at = np.arange(self.px.shape[1]) if cameras is None else np.array(cameras)
        seen = self.is_seen[:, at]
        views, frames, joints = np.nonzero(np.moveaxis(seen & (seen.sum(axis=1, keepdims=True) > 1), 1, 0))
        return Observations(views, frames * self.n_joints + joints, self.px[frames, at[views], joints])

    def by_joint(self, points_world: Array) -> Array:
        """Return points, (P, 3), by frame and joint, (F, N, 3); NaN for those beyond the last one."""
        out = np.full((len(self.px) * self.n_joints, 3), np.nan)
        out[: len(points_world)] = points_world
        return out.reshape(len(self.px), self.n_joints, 3)


def own_columns(observations: ObservationSet) -> list[int]:
    """Return the columns of points that a detector finds itself: a mean of two points is none."""
    of = observations.counterparts
    return [i for i, name in enumerate(observations.point_names) if len(of[name]) <= 1]


def joints_of_people(
    observations: ObservationSet, persons: IntArray, n_people: int, cameras: Sequence[Camera] | None = None
) -> SeenJoints:
    """Return the joints of people. A joint counts where its detector holds it for more likely right than wrong.

    Args:
        observations: key points in pictures.
        persons: person of each detection, (n_frames, n_views, n_detections); -1 for one of nobody.
        n_people: number of people.
        cameras: cameras that are about right, by which left and right are exchanged in pictures that contradict the
            others; None to leave them.
    """
    single, of = own_columns(observations), observations.counterparts
    names = tuple("".join(of[observations.point_names[i]]) for i in single)
    px, is_seen = [], []
    for person in range(n_people):
        own_px, confidence = points_of_person(observations, persons == person)
        if cameras is not None:
            own_px, confidence = _with_sides_mended(observations, own_px, confidence, cameras)
        is_seen.append((confidence > 1 - confidence)[..., single])
        px.append(np.where(is_seen[-1][..., None], own_px[:, :, single], np.nan))
    return SeenJoints(names, np.concatenate(px, axis=2), np.concatenate(is_seen, axis=2), n_people)


def points_of_person(observations: ObservationSet, is_own: Mask) -> tuple[Array, Array]:
    """Return the points, (F, V, n_points, 2), and confidence of the marked detections, (F, V, D); 0 without one."""
    points = observations.points
    assert points is not None
    at = is_own.argmax(axis=-1)[..., None, None]
    own_px = np.take_along_axis(points.points_px, at[..., None], axis=2)[:, :, 0]
    confidence = np.take_along_axis(points.confidence, at, axis=2)[:, :, 0]
    return own_px, np.where(is_own.any(axis=-1, keepdims=True), confidence, 0.0)


def _with_sides_mended(
    observations: ObservationSet, px: Array, confidence: Array, cameras: Sequence[Camera]
) -> tuple[Array, Array]:
    """Exchange left and right of a person in pictures that contradict the others."""
    views = Views(cameras)
    values = np.concatenate([px, confidence[..., None]], axis=-1)
    undistorted = views.undistorted(px)
    known = np.where(np.isfinite(undistorted).all(axis=-1), confidence, 0.0)
    for pairs in side_pairs(observations):
        flags = exchanged_sides(views, np.where(known[..., None] > 0, undistorted, np.nan), known, pairs)
        values = with_sides_exchanged(values, pairs, flags)
    return values[..., :2], values[..., 2]
