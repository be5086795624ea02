"""Pictures of a board as cameras without distortion see it, and folders of them."""

import cv2
import numpy as np
import rigs

from tracker.geometry import rigid

SQUARE_PX = 60
"""Side of a square of the flat drawing."""


def flat(board):
    """The board itself, seen at a right angle, without a margin."""
    if board.kind == "checkerboard":
        dark = np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2 == 0
        image = np.kron(np.where(dark, 0, 255), np.ones((SQUARE_PX, SQUARE_PX))).astype(np.uint8)
    else:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        drawn = cv2.aruco.CharucoBoard((board.columns, board.rows), 1.0, board.marker_share, dictionary)
        drawn.setLegacyPattern(board.legacy)
        image = drawn.generateImage((board.columns * SQUARE_PX, board.rows * SQUARE_PX), marginSize=0)
    return 255 - image if board.inverted else image


def drawn(board, camera, T_world_board, from_behind=False):
    """Picture of a board on a gray ground, (H, W); empty from behind, but `from_behind` shows a transparent one."""
    T = camera.T_camera_world @ T_world_board
    if (T[:3, 2] @ T[:3, 3] < 0) != from_behind:
        return np.full(camera.size[::-1], 120, np.uint8)
    to_metres = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, SQUARE_PX / board.square_m]]) / SQUARE_PX * board.square_m
    H = camera.K @ np.stack([T[:3, 0], T[:3, 1], T[:3, 3]], axis=1) @ to_metres
    # Drawn at four times the size and reduced, so that edges are as smooth as those of a camera.
    larger = np.array([[4, 0, 1.5], [0, 4, 1.5], [0, 0, 1]])
    size = (4 * camera.width, 4 * camera.height)
    margin = SQUARE_PX // 2
    ground = 0 if board.inverted else 255
    paper = cv2.copyMakeBorder(flat(board), *[margin] * 4, cv2.BORDER_CONSTANT, value=ground)
    H = larger @ H @ np.array([[1, 0, -margin], [0, 1, -margin], [0, 0, 1]])
    image = cv2.warpPerspective(paper, H, size, flags=cv2.INTER_LINEAR, borderValue=120)
    return cv2.resize(image, camera.size, interpolation=cv2.INTER_AREA)


def facing(place, toward, roll=0.0, tilt=(0.0, 0.0)):
    """Pose of a board at a place whose front looks toward another."""
    T = rigs.looking(toward, place, roll)
    return rigid.transform(T[:3, :3] @ rigid.so3_exp(np.array([*tilt, 0.0])), np.asarray(place, float))


def arc(n=3, size=(640, 480)):
    """Cameras within a quarter of a circle, without distortion."""
    places = [rigs.on_circle(a, 2.0, 1.2 + 0.2 * i) for i, a in enumerate(np.linspace(0, np.pi / 2, n))]
    return rigs.cameras([rigs.looking(p) for p in places], size=size)


def carried(board, n, seed=0):
    """Poses of a board that faces the middle of the arc, tilted and turned, at other places."""
    random = np.random.default_rng(seed)
    middle = np.append(-board.outline.mean(axis=0), 0.0)
    out = []
    for _ in range(n):
        place = (
            np.array([0.0, 0.0, 1.0])
            + random.uniform(-0.25, 0.25, 3)
            + random.uniform(-0.3, 0.6) * np.array([0.7, 0.7, 0])
        )
        toward = rigs.on_circle(np.pi / 4 + random.uniform(-0.5, 0.5), 2.0, 1.4)
        out.append(
            facing(place, toward, random.uniform(0, 6), random.uniform(-0.4, 0.4, 2)) @ rigid.transform(None, middle)
        )
    return out


def filmed_folders(folder, board, cameras, poses):
    """A folder of images for each camera; returns them."""
    out = []
    for camera in cameras:
        path = folder / camera.name
        path.mkdir(parents=True)
        for k, T in enumerate(poses):
            cv2.imwrite(str(path / f"{k:04d}.png"), drawn(board, camera, T))
        out.append(path)
    return out
