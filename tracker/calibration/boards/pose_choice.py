"""Choose between poses of a board that look alike: the one of which all corners of a frame have the smallest errors."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import BoardProblem, SeenCorners
from tracker.calibration.boards.view_choice import posed_views
from tracker.calibration.check.rig_adjustment import Prior, Rig
from tracker.estimation.fitting.bundle import ROUGH, solve_bundle
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import MAX_LENS_RADIUS, Camera

Poses = Mapping[tuple[int, int], Sequence[Array]]
"""Poses of the board in front of cameras, `T_camera_board`, by camera and frame."""

_STEPS = 6
"""Steps by which each pose is refined before it is compared: Gauss-Newton on six unknowns converges within them."""
_BESIDE = rigid.transform(None, np.array([0.0, 0.0, 1.0]))
"""Pose of a board whose corners determine none, from which no fit starts well: a metre in front of the camera."""


def board_poses(board: Board, seen: SeenCorners, *cameras: Camera) -> dict[tuple[int, int], list[Array]]:
    """Return poses of the board in front of cameras, `T_camera_board`, likeliest first, by camera and frame.

    A flat board that is small in the picture has two poses that look alike (Collins & Bartoli 2014).
    """
    out = {}
    for (index, frame), at in posed_views(board, seen).items():
        camera, corners = cameras[index], board.corners[seen.ids[at]]
        found = _planar_poses(corners, camera, seen.px[at])
        # A lens that is not known yet may not show all corners.
        out[index, frame] = found or _planar_poses(corners, camera.pinhole, seen.px[at]) or [_BESIDE]
    return out


def _planar_poses(corners: Array, camera: Camera, px: Array) -> list[Array]:
    """Return the poses of a flat board in front of a camera; none if the camera does not show all corners."""
    rays = camera.rays(px) @ camera.T_world_camera[:3, :3]
    slopes = rays[:, :2] / np.maximum(rays[:, 2:], 1 / MAX_LENS_RADIUS)  # farther aside a pinhole shows no corner
    if not np.isfinite(slopes).all():
        return []
    _, turns, shifts, _ = cv2.solvePnPGeneric(corners, slopes, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    return [
        rigid.transform(rigid.so3_exp(np.asarray(w, float).ravel()), np.asarray(t, float).ravel())
        for w, t in zip(turns, shifts, strict=True)
    ]


def posed_frames(poses: Poses, seen: SeenCorners) -> IntArray:
    """Return the frames with corners on which some camera determines a pose, ascending."""
    return np.array(sorted({k for _, k in poses} & set(seen.frames.tolist())), dtype=np.int64)


def best_poses(problem: BoardProblem, cameras: Sequence[Camera], poses: Poses, now: Array | None = None) -> Array:
    """Return `T_world_board` of each frame, (F, 4, 4): the best of what single cameras propose, refined for all.

    Args:
        problem: corners and noise; its cameras are held.
        cameras: where they stand.
        poses: of the board in front of them.
        now: present poses, (F, 4, 4), which compete.
    """
    still = problem.with_prior(Prior.held(cameras))
    candidates = [
        [c.T_world_camera @ T for i, c in enumerate(cameras) for T in poses.get((i, int(k)), ())]
        for k in problem.frames
    ]
    best, own = np.full(len(candidates), np.inf), np.stack([c[0] for c in candidates])
    trials = [] if now is None else [now]
    trials += [np.stack([c[min(n, len(c) - 1)] for c in candidates]) for n in range(max(map(len, candidates)))]
    for trial in trials:
        rig = solve_bundle(still, Rig(tuple(cameras), trial), _STEPS, ROUGH).state
        costs = still.group_costs(rig)
        own[costs < best] = rig.own[costs < best]
        best = np.minimum(best, costs)
    return own
