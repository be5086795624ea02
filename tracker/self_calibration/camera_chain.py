"""All cameras, one after the other: the pair that its joints determine best, then each by joints known in space."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np

from tracker.boards.camera_graph import MIN_SHARED
from tracker.calibration.reprojection import OUTLIER_SIGMAS
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.self_calibration.joint_adjustment import Gauge, adjust_joints, no_common_view
from tracker.self_calibration.seen_joints import SeenJoints
from tracker.self_calibration.stature import metres_per_unit, scaled_by
from tracker.self_calibration.two_views import TwoViews, relate


def chain_cameras(
    seen: SeenJoints, lenses: Sequence[Camera], statures_m: Sequence[float]
) -> tuple[tuple[Camera, ...], Gauge]:
    """Find the poses of cameras with known lenses, metres, in the world of one of them.

    Args:
        seen: joints of people.
        lenses: the cameras with their lenses.
        statures_m: of each person, metres; NaN for one who does not count for the scale.

    Raises:
        CalibrationError: no two cameras show the person from different sides, or one shows too little of the person.
    """
    pairs = [relate(seen, (i, j), lenses[i], lenses[j]) for i, j in combinations(range(len(lenses)), 2)]
    found = [pair for pair in pairs if pair is not None]
    if not found:
        raise no_common_view()
    best = min(found, key=lambda pair: pair.rotation_sigma)
    return _completed(seen, lenses, best, statures_m), Gauge(*best.pair)


def _completed(
    seen: SeenJoints, lenses: Sequence[Camera], start: TwoViews, statures_m: Sequence[float]
) -> tuple[Camera, ...]:
    """Add the cameras to a pair, each time the one that sees most of the joints that are known in space."""
    joints = seen.by_joint(start.adjusted.points_world)
    scale = metres_per_unit(joints, seen.names, statures_m)
    joints = joints * scale
    sigma_px = start.adjusted.sigma_px
    placed = dict(zip(start.pair, scaled_by(start.adjusted.cameras, scale), strict=True))
    while len(placed) < len(lenses):
        known = np.isfinite(joints).all(axis=-1)
        counts = {i: int((known & seen.is_seen[:, i]).sum()) for i in range(len(lenses)) if i not in placed}
        nxt = max(counts, key=counts.__getitem__)
        placed[nxt] = _resected(seen, nxt, lenses[nxt], joints, sigma_px)
        order = sorted(placed)
        adjusted = adjust_joints(
            [placed[i] for i in order],
            seen.observations(order),
            seen.n_joints,
            Gauge(order.index(start.pair[0]), order.index(start.pair[1])),
        )
        assert adjusted is not None
        placed = dict(zip(order, adjusted.cameras, strict=True))
        joints, sigma_px = seen.by_joint(adjusted.points_world), adjusted.sigma_px
    return tuple(placed[i] for i in range(len(lenses)))


def _resected(seen: SeenJoints, index: int, lens: Camera, joints: Array, sigma_px: float) -> Camera:
    """Return a camera by what it sees of joints that are known in space, (F, N, 3), metres."""
    at = np.isfinite(joints).all(axis=-1) & seen.is_seen[:, index]
    n_frames = int(at.any(axis=1).sum())
    if n_frames < MIN_SHARED:
        raise CalibrationError(
            f"expected the person in at least {MIN_SHARED} frames of camera '{lens.name}' and of two others, found "
            f"{n_frames}; film the person where they see it together"
        )
    rays = lens.rays(seen.px[:, index][at])
    slopes, threshold = rays[:, :2] / rays[:, 2:], OUTLIER_SIGMAS * sigma_px / float(lens.K[0, 0])
    ok, rotation, shift, _ = cv2.solvePnPRansac(
        joints[at], slopes, np.eye(3), None, reprojectionError=threshold, flags=cv2.SOLVEPNP_SQPNP
    )
    if not ok:
        raise CalibrationError(
            f"expected camera '{lens.name}' to agree with the others on where the person is, found that it does not; "
            "check that its videos show the same instants"
        )
    w, t = (np.asarray(v, dtype=np.float64).ravel() for v in (rotation, shift))
    T_camera_world = rigid.transform(rigid.so3_exp(w), t)
    return replace(lens, T_world_camera=rigid.inverse(T_camera_world))
