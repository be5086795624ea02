"""Other cameras that explain the same joints, and the refusal of joints that do not show which ones are right.

Cameras whose distance is large against the motion of a person make almost parallel projections. Joints that are
reflected through their middle then look the same in cameras that are turned half about their rays to it (Necker
reversal; Szeliski and Kang 1997, Shape ambiguities in structure from motion). Perspective alone shows which ones are
right, but an adjustment that begins at the wrong ones stays there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.rig_adjustment import OUTLIER_SIGMAS, robust_squares
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, UnknownLenses, adjust_joints
from tracker.calibration.self_calibration.person_calibration import volume_error
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.errors import CalibrationError
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera


class Solution(NamedTuple):
    """Cameras that joints have led to."""

    adjusted: AdjustedJoints
    gauge: Gauge


class Solutions(NamedTuple):
    """All cameras that explain the joints about equally well."""

    chosen: Solution
    rivals: tuple[Solution, ...]
    """Solutions that differ from the chosen one by more than its stated error."""


def compared(found: Sequence[Solution], seen: SeenJoints, lenses: UnknownLenses | None) -> Solutions:
    """Choose a solution of the least misfit, and follow its reversal, too.

    Args:
        found: solutions, at least one. Of those that are not clearly worse than the best one, the first is chosen.
        seen: joints that they were adjusted to.
        lenses: knowledge of the lenses; None for lenses that stay as they are.
    """
    reverse = reversed_in_depth(_close(found, seen)[0], seen, lenses)
    close = _close(found if reverse is None else [*found, reverse], seen)
    return Solutions(close[0], tuple(s for s in close if _differs(s.adjusted, close[0].adjusted)))


def require_one_solution(
    chosen: Solution, rivals: Sequence[Solution], seen: SeenJoints, lenses: UnknownLenses | None
) -> None:
    """Refuse joints that other cameras explain as well.

    Args:
        chosen: cameras that were adjusted to the joints.
        rivals: other ones, which some of the joints allow.
        seen: the joints.
        lenses: knowledge of the lenses; None for lenses that stay as they are.

    Raises:
        CalibrationError: cameras that differ by more than the stated error are not clearly worse.
    """
    for other in _followed(chosen, rivals, seen, lenses):
        own, others = misfits([chosen.adjusted, other.adjusted], seen)
        if others < own + CLEAR_NATS and _differs(other.adjusted, chosen.adjusted):
            raise CalibrationError(
                "expected key points that fit one arrangement of the cameras, found another one, as with near and far "
                f"exchanged, that fits them as well (worse by {others - own:.1f} nats, {CLEAR_NATS:.0f} are clear); "
                "let the person walk towards the cameras and away from them, or put the cameras nearer"
            )


def misfits(found: Sequence[AdjustedJoints], seen: SeenJoints) -> Array:
    """Return how badly solutions explain the joints, (n_solutions,), nats: differences are logarithms of odds.

    All have the noise of the best one, and errors count by the share by which they agree. Joints that a solution does
    not determine are gross errors.
    """
    best = min(found, key=lambda a: a.sigma_px * len(seen.observations().px) / len(a.observed.px))
    n, out = len(seen.observations().px), []
    for solution in found:
        squares = np.nan_to_num(np.sum(solution.fit.errors_px**2, axis=1), nan=np.inf) / best.sigma_px**2
        out.append(0.5 * (robust_squares(squares).sum() + OUTLIER_SIGMAS**2 * (n - len(squares))))
    return np.array(out) / best.share


def reversed_in_depth(solution: Solution, seen: SeenJoints, lenses: UnknownLenses | None) -> Solution | None:
    """Return the solution that begins with near and far exchanged; None where its cameras see no joint together."""
    turned = turned_half(solution.adjusted.cameras, np.nanmedian(solution.adjusted.points_world, axis=0))
    return _adjusted(turned, solution.gauge, seen, lenses)


def turned_half(cameras: Sequence[Camera], middle_world: Array) -> tuple[Camera, ...]:
    """Turn each camera half about its ray to a point, (3,)."""
    out = []
    for camera in cameras:
        ray = camera.T_camera_world[:3, :3] @ (middle_world - camera.center_world)
        turn = 2 * np.outer(ray, ray) / (ray @ ray) - np.eye(3)
        out.append(replace(camera, T_world_camera=camera.T_world_camera @ rigid.transform(turn, None)))
    return tuple(out)


def _close(found: Sequence[Solution], seen: SeenJoints) -> list[Solution]:
    """Return the solutions that are not clearly worse than the best one."""
    nats = misfits([s.adjusted for s in found], seen)
    return [s for s, n in zip(found, nats, strict=True) if n < nats.min() + CLEAR_NATS]


def _followed(
    chosen: Solution, rivals: Sequence[Solution], seen: SeenJoints, lenses: UnknownLenses | None
) -> Iterator[Solution]:
    """Adjust the reversal and the rivals to all joints."""
    starts = [reversed_in_depth(chosen, seen, lenses)]
    starts += [_adjusted(s.adjusted.cameras, s.gauge, seen, lenses) for s in rivals]
    yield from (s for s in starts if s is not None)


def _adjusted(
    cameras: Sequence[Camera], gauge: Gauge, seen: SeenJoints, lenses: UnknownLenses | None
) -> Solution | None:
    try:
        adjusted = adjust_joints(cameras, seen.observations(), seen.n_joints, gauge, lenses)
    except np.linalg.LinAlgError:  # almost no joint is in front of two of these cameras
        return None
    return None if adjusted is None else Solution(adjusted, gauge)


def _differs(a: AdjustedJoints, b: AdjustedJoints) -> bool:
    """Return whether joints of two solutions are farther apart than the second one's stated error, by their median.

    They are compared after the best similarity without reflection (Umeyama 1991).
    """
    n = min(len(a.points_world), len(b.points_world))
    known = np.isfinite(a.points_world[:n]).all(axis=1) & np.isfinite(b.points_world[:n]).all(axis=1)
    x, y = a.points_world[:n][known], b.points_world[:n][known]
    if not len(x):
        return True
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    U, S, Vt = np.linalg.svd(y.T @ x)
    signs = np.array([1.0, 1.0, np.linalg.det(U @ Vt)])
    scale = float(S @ signs) / np.sum(x**2)
    apart = np.linalg.norm(scale * x @ (U * signs @ Vt).T - y, axis=1)
    return bool(np.median(apart) > volume_error(b, 1.0).high_m)
