"""All cameras, one after the other: a pair that its joints determine well, then each by joints known in space.

The covariance of a pair holds for the solution that was found, and a wrong one may have a small one. So several pairs
are followed to the end.

Relative pose of two cameras from joints that both see (Hartley and Zisserman 2004, Sect. 9.6).
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.boards.view_choice import MIN_CORNERS
from tracker.calibration.check.rig_adjustment import OUTLIER_SIGMAS, column_ends
from tracker.calibration.self_calibration.joint_adjustment import (
    AdjustedJoints,
    Gauge,
    UnknownLenses,
    adjust_joints,
    no_common_view,
)
from tracker.calibration.self_calibration.person_calibration import adjusted_to
from tracker.calibration.self_calibration.rival_cameras import Solution, Solutions, compared
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.calibration.self_calibration.stature import metres_per_unit
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.camera_derivatives import ROTATION
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera


class TwoViews(NamedTuple):
    """Two cameras and the joints that both see, with the distance between the cameras as the unit."""

    pair: tuple[int, int]
    adjusted: AdjustedJoints
    rotation_sigma: float
    """Standard deviation of their relative rotation, rad."""


def relate(seen: SeenJoints, pair: tuple[int, int], a: Camera, b: Camera) -> TwoViews | None:
    """Return two cameras with known lenses; None where the joints that both see do not determine them.

    The relative pose with the least median of epipolar errors needs no threshold, and is fitted to all joints robustly.
    """
    observations = seen.observations(pair)
    at = [observations.of_camera(i) for i in range(2)]
    rays = [c.rays(observations.px[part]) for c, part in zip((a, b), at, strict=True)]
    x, y = (r[:, :2] / r[:, 2:] for r in rays)
    valid = np.isfinite(x).all(axis=1) & np.isfinite(y).all(axis=1)
    if valid.sum() < MIN_CORNERS:
        return None
    E, _ = cv2.findEssentialMat(x[valid], y[valid], np.eye(3), cv2.LMEDS)
    if E is None or E.shape != (3, 3):
        return None
    _, R, t, _ = cv2.recoverPose(E, x[valid], y[valid], np.eye(3))
    T_b_a = rigid.transform(np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64).ravel())
    cameras = (replace(a, T_world_camera=np.eye(4)), replace(b, T_world_camera=rigid.inverse(T_b_a)))
    adjusted = adjust_joints(cameras, observations, seen.n_joints, Gauge(0, 1))
    if adjusted is None or len(adjusted.observed.px) < len(observations.px) / 2:
        return None  # rays to most joints are parallel
    return TwoViews(pair, adjusted, _rotation_sigma(adjusted))


def _rotation_sigma(adjusted: AdjustedJoints) -> float:
    start = column_ends(adjusted.cameras)[1]
    variances: Array = np.diag(adjusted.fit.covariance)[start:][ROTATION]
    return float(np.sqrt(variances.sum()))


def chain_cameras(
    seen: SeenJoints, cameras: Sequence[Camera], statures_m: Sequence[float], lenses: UnknownLenses | None
) -> Solutions:
    """Find cameras from nothing, the best ones of several chains.

    As many chains are followed as there are cameras. Cameras that face each other, which joints determine worst, are at
    most half as many pairs.

    Args:
        seen: joints of people.
        cameras: with their lenses, or average ones.
        statures_m: of each person, metres; NaN for one who does not count for the scale.
        lenses: knowledge of the lenses; None for lenses that stay as they are.

    Raises:
        CalibrationError: no two cameras show the person from different sides, or one shows too little of the person.
    """
    pairs = [relate(seen, (i, j), cameras[i], cameras[j]) for i, j in combinations(range(len(cameras)), 2)]
    related = sorted((pair for pair in pairs if pair is not None), key=lambda pair: pair.rotation_sigma)
    found, failures = list[Solution](), list[Exception]()
    for pair in related[: len(cameras)]:
        gauge = Gauge(*pair.pair)
        try:
            placed = _completed(seen, cameras, pair, statures_m)
            found.append(Solution(adjusted_to(placed, seen, gauge, lenses), gauge))
        except (CalibrationError, np.linalg.LinAlgError) as error:
            failures.append(error)
    if not found:
        raise failures[0] if failures else no_common_view()
    return compared(found, seen, lenses)


def _completed(
    seen: SeenJoints, lenses: Sequence[Camera], start: TwoViews, statures_m: Sequence[float]
) -> tuple[Camera, ...]:
    """Add the cameras to a pair, each time the one that sees most of the joints that are known in space."""
    joints = seen.by_joint(start.adjusted.points_world)
    scale = metres_per_unit(joints, seen.names, statures_m)
    joints = joints * scale
    sigma_px = start.adjusted.sigma_px
    placed = dict(zip(start.pair, scaled_cameras(start.adjusted.cameras, scale), strict=True))
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
        if adjusted is None:
            raise no_common_view()
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
    T_camera_world = pose_before_joints(joints[at], rays[:, :2] / rays[:, 2:], sigma_px / float(lens.K[0, 0]))
    if T_camera_world is None:
        raise CalibrationError(
            f"expected camera '{lens.name}' to agree with the others on where the person is, found that it does not; "
            "check that its videos show the same instants"
        )
    return replace(lens, T_world_camera=rigid.inverse(T_camera_world))


def pose_before_joints(joints: Array, slopes: Array, sigma: float) -> Array | None:
    """Return the pose of a camera, `T_camera_world`, by most of the joints that it sees; None where most disagree.

    Args:
        joints: (n, 3), metres; some of them are grossly wrong.
        slopes: of their rays in the camera, (n, 2).
        sigma: standard deviation of a slope.
    """
    threshold = OUTLIER_SIGMAS * sigma
    ok, rotation, shift = False, np.zeros(3), np.zeros(3)
    with suppress(cv2.error):  # joints of one place, all others apart from their rays
        ok, rotation, shift, _ = cv2.solvePnPRansac(
            joints, slopes, np.eye(3), None, reprojectionError=threshold, flags=cv2.SOLVEPNP_SQPNP
        )
    w, t = (np.asarray(v, dtype=np.float64).ravel() for v in (rotation, shift))
    return rigid.transform(rigid.so3_exp(w), t) if ok else None
