"""Which observed points of each person are points of the body, over all frames and views."""

from collections.abc import Sequence

import numpy as np

from tracker.estimation.acquisition.from_keypoints import PersonObservations
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.robust_triangulation import Views
from tracker.interchange.observations.observed import ObservationSet, observed_joints, triangulate_observations


def body_points(observations: ObservationSet, cameras: Sequence[Camera]) -> dict[str, PersonObservations]:
    """Return the points of each person by name.

    Key points are matched across views and triangulated, exchanged sides are mended. Joints in space are seen by all
    cameras that they are in front of.

    Args:
        observations: of any kind.
        cameras: of the session, in its order.
    """
    columns = [(names[0], i) for i, names in enumerate(observations.counterparts.values()) if len(names) == 1]
    names, at = tuple(n for n, _ in columns), [i for _, i in columns]
    if observations.points is None:
        joints, views = observed_joints(observations, cameras), Views(cameras)
        return {
            person: _projected(views, names, joints.joints_world[:, i, at])
            for i, person in enumerate(observations.people)
        }
    found = triangulate_observations(observations, cameras)
    joints_world, px, confidence = found.joints.joints_world, found.positions_px[..., at, :], found.confidence[..., at]
    return {
        person: PersonObservations(names, joints_world[:, i, at], _normalized(cameras, px[:, i]), confidence[:, i])
        for i, person in enumerate(observations.people)
    }


def _projected(views: Views, names: tuple[str, ...], joints_world: Array) -> PersonObservations:
    px, depths = views.project(joints_world)
    px, depths = np.moveaxis(px, 2, 1), np.moveaxis(depths, 2, 1)
    is_seen = np.isfinite(px).all(axis=-1) & (depths > NEAR_PLANE_M)
    return PersonObservations(names, joints_world, _normalized(views.cameras, px), is_seen.astype(np.float64))


def _normalized(cameras: Sequence[Camera], px: Array) -> Array:
    """Map undistorted px of each view, (F, V, N, 2), to normalized image coordinates."""
    out = np.empty_like(px)
    for v, camera in enumerate(cameras):
        K = camera.pinhole.K
        out[:, v] = (px[:, v] - K[:2, 2]) @ np.linalg.inv(K[:2, :2]).T
    return out
