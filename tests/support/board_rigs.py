"""Simulated cameras that film a board: corners with noise, partly visible, and the true cameras."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import rigs

from tracker.calibration.boards.board_calibration import calibrate_rig
from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.expected_error import in_pictures
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

BOARDS = [
    Board("charuco", 5, 7, 0.06, dictionary="DICT_5X5_100"),
    Board("charuco", 4, 5, 0.054),
    Board("charuco", 8, 6, 0.1),
]


class SimulatedRig(NamedTuple):
    """Corners of a board that cameras have seen, and the truth."""

    board: Board
    cameras: list[Camera]
    seen: SeenCorners
    Ts_world_board: np.ndarray
    """Poses of the middle of the board."""
    sigmas_px: np.ndarray


def simulated_rig(seed, n_cameras=None, n_frames=60, fisheye=False, gross=0.01):
    """Two to five cameras with any lenses, noise of 0.1 to 0.6 px and one of three boards."""
    random = np.random.default_rng(seed)
    board = BOARDS[seed % len(BOARDS)]
    cameras = true_cameras(random, n_cameras or int(random.integers(2, 6)), fisheye)
    Ts = board_poses(random, n_frames)
    sigmas = random.uniform(0.1, 0.6, len(cameras))
    return SimulatedRig(board, cameras, filmed(random, board, cameras, Ts, sigmas, gross), Ts, sigmas)


def calibrated(rig):
    """The calibration of a simulated rig from what it has seen."""
    names, sizes = [c.name for c in rig.cameras], [c.size for c in rig.cameras]
    return calibrate_rig(rig.board, rig.seen, names, sizes, [c.fisheye for c in rig.cameras])


def true_cameras(random, n=4, fisheye=False):
    """Cameras around a volume, with lenses as they are sold."""
    out = []
    radius, arc = random.uniform(2.0, 4.0), random.uniform(2.0, 2 * np.pi)
    for i in range(n):
        place = rigs.on_circle(
            arc * i / n + random.normal() / 10, radius * random.uniform(0.85, 1.15), random.uniform(1, 2)
        )
        T = rigs.looking(place, np.array([0, 0, 1]) + 0.15 * random.normal(size=3), random.choice([0, 0, np.pi / 2]))
        size = [(1280, 720), (1920, 1080), (640, 480)][random.integers(3)]
        f = max(size) * random.uniform(0.6, 1.2)
        off = 0.01 * max(size) * random.normal(size=2)
        aspect = np.exp(0.001 * random.normal())
        K = np.array(
            [[f * aspect, 0, size[0] / 2 - 0.5 + off[0]], [0, f / aspect, size[1] / 2 - 0.5 + off[1]], [0, 0, 1]]
        )
        k1 = random.normal(scale=0.15)
        distortion = [k1, -0.3 * k1 + 0.03 * random.normal(), *(0.001 * random.normal(size=2)), 0.02 * random.normal()]
        if fisheye:
            distortion = (0.02 * random.normal(size=4)).tolist()
        out.append(Camera(f"cam{i}", size, K, np.array(distortion), T, fisheye))
    return out


def board_poses(random, n, spread=(0.7, 0.7, 0.6)):
    """Poses of a board that a person carries around and turns to the cameras, (n, 4, 4)."""
    out = []
    for _ in range(n):
        place = np.array([0.0, 0.0, 1.0]) + random.uniform(-1, 1, 3) * spread
        toward = rigs.on_circle(random.uniform(0, 2 * np.pi), 3.0, random.uniform(0.5, 2.5))
        T = rigs.looking(
            toward, place, random.uniform(0, 2 * np.pi)
        )  # its z looks at the place, so from the outside in
        R = T[:3, :3] @ rigid.so3_exp(0.3 * random.normal(size=3))
        out.append(rigid.transform(R, place))
    return np.stack(out)


def filmed(random, board, cameras, Ts_world_board, sigmas_px, gross=0.01, covered=0.3):
    """Corners that the cameras see of the front of a board; a hand covers a side of it in some frames."""
    columns = [[], [], [], []]
    middle = np.append(board.outline.mean(axis=0), 0.0)
    for i, camera in enumerate(cameras):
        for k, T in enumerate(Ts_world_board):
            corners = board.corners - middle
            X = rigid.apply(T, corners)
            toward = camera.center_world - T[:3, 3]
            # Seen from the front, z leads away from the camera.
            if -toward @ T[:3, 2] < np.cos(np.radians(65)) * np.linalg.norm(toward):
                continue
            px = camera.project(X)
            shown = np.all((px > 5) & (px < np.array(camera.size) - 6), axis=1)
            if random.random() < covered:
                side = random.normal(size=2)
                along = corners[:, :2] @ side
                shown &= along < np.quantile(along, random.uniform(0.4, 0.9))
            if shown.sum() < 4:
                continue
            px = px[shown] + sigmas_px[i] * random.normal(size=(int(shown.sum()), 2))
            wrong = random.random(len(px)) < gross
            px[wrong] += 20 * random.normal(size=(int(wrong.sum()), 2))
            for column, rows in zip(
                columns, (np.full(len(px), i), np.full(len(px), k), np.flatnonzero(shown), px), strict=True
            ):
                column.append(rows)
    return SeenCorners(*(np.concatenate(column) for column in columns))


def rms_error_m(true, found, points_world):
    """RMS distance of points to where the found cameras triangulate their true pictures, after the best rigid fit."""
    shown = in_pictures(true, points_world)
    triangulated = []
    for j, X in enumerate(points_world):
        A, b = np.zeros((3, 3)), np.zeros(3)
        for i in np.flatnonzero(shown[:, j]):
            ray = found[i].rays(true[i].project(X))
            across = np.eye(3) - np.outer(ray, ray)
            A, b = A + across, b + across @ found[i].center_world
        triangulated.append(np.linalg.solve(A, b) if shown[:, j].sum() >= 2 else np.full(3, np.nan))
    there, here = np.array(triangulated), points_world
    known = np.isfinite(there[:, 0])
    there, here = there[known], here[known]
    a, b = there.mean(axis=0), here.mean(axis=0)
    U, _, Vt = np.linalg.svd((there - a).T @ (here - b))
    R = (U * [1, 1, np.linalg.det(U @ Vt)]) @ Vt
    return float(np.sqrt(np.mean(np.sum(((there - a) @ R - (here - b)) ** 2, axis=1))))


def in_first_camera(cameras):
    """The same cameras in the frame of the first one."""
    T = rigid.inverse(cameras[0].T_world_camera)
    return [replace(c, T_world_camera=T @ c.T_world_camera) for c in cameras]
