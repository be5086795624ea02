"""Joints of one person in the pictures of all cameras, as observations of free points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.calibration.reprojection import Observations
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.cameras import Camera
from tracker.observations.joints import side_pairs, triangulate_observations
from tracker.observations.observed import ObservationSet
from tracker.observations.sides import with_sides_exchanged


@dataclass(frozen=True, eq=False)
class SeenJoints:
    """Joints of one person in the pictures of all cameras. Joint j on the k-th frame is point k * n_joints + j."""

    names: tuple[str, ...]
    """Point of the body that each joint is, (N,); empty for one that the body lacks, such as an eye."""
    px: Array
    """Original pixels, (F, V, N, 2)."""
    is_seen: Mask
    """Whether a camera shows a joint, (F, V, N)."""

    @property
    def n_joints(self) -> int:
        """Number of joints, N."""
        return len(self.names)

    def on_frames(self, frames: IntArray | Mask) -> "SeenJoints":
        """Return the joints on some frames."""
        return replace(self, px=self.px[frames], is_seen=self.is_seen[frames])

    def with_more(self, others: "SeenJoints") -> "SeenJoints":
        """Return the joints with others on the same frames."""
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


def lone_person(observations: ObservationSet) -> tuple[SeenJoints, int]:
    """Return the joints of the person in pictures that show nobody else, and the number of the other pictures.

    A joint counts where its detector holds it for more likely right than wrong.
    """
    points = observations.points
    assert points is not None
    people = points.is_known.any(axis=-1).sum(axis=-1)
    # Means of two points are no points of their own.
    of = observations.counterparts
    single = [i for i, name in enumerate(observations.point_names) if len(of[name]) <= 1]
    at = points.is_known.any(axis=-1).argmax(axis=-1)[..., None, None]
    confidence = np.take_along_axis(points.confidence, at, axis=2)[:, :, 0, single]
    px = np.take_along_axis(points.points_px, at[..., None], axis=2)[:, :, 0, single]
    is_seen = (people == 1)[..., None] & (confidence > 1 - confidence)
    names = tuple("".join(of[observations.point_names[i]]) for i in single)
    return SeenJoints(names, np.where(is_seen[..., None], px, np.nan), is_seen), int((people > 1).sum())


def with_sides_mended(observations: ObservationSet, seen: SeenJoints, cameras: Sequence[Camera]) -> SeenJoints:
    """Exchange left and right in pictures that contradict the others, by cameras that are about right."""
    found = triangulate_observations(observations, cameras)
    values = np.concatenate([seen.px, seen.is_seen[..., None].astype(np.float64)], axis=-1)
    at = {name: i for i, name in enumerate(seen.names) if name}
    names = [points[0] if len(points) == 1 else "" for points in observations.counterparts.values()]
    for group, pairs in enumerate(side_pairs(observations)):
        own = [(at[names[left]], at[names[right]]) for left, right in pairs]
        values = with_sides_exchanged(values, own, found.is_exchanged[:, 0, :, group])
    return replace(seen, px=values[..., :2], is_seen=np.asarray(values[..., 2] > 0))
