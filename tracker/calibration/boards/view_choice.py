"""Choose diverse views of a board: a bounded number of those that differ most in place, size and tilt."""

from itertools import combinations, pairwise

import cv2
import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.compute.sampling import farthest_first
from tracker.geometry.arrays import Array, IntArray

MIN_CORNERS = 6
"""Fewest corners by which a view determines a board's pose: 6 have 12 coordinates for 6 unknowns, so that half of them
check it."""
MAX_LENS_VIEWS = 60
"""Most views from which a lens is fitted. Zhang (2000, Fig. 3) finds little gain beyond 10."""
MAX_FRAMES = 240
"""Most frames of the adjustment of all cameras, for its time: half a minute with eight cameras."""
_MIN_SPREAD = 0.1
"""Least extent of corners across their longest extent: those of one row are on a line and determine no pose."""


def posed_views(board: Board, seen: SeenCorners) -> dict[tuple[int, int], slice]:
    """Return the corners of each view that determines a pose of the board, by camera and frame."""
    out = {}
    starts = np.flatnonzero((np.diff(seen.cameras, prepend=-1) != 0) | (np.diff(seen.frames, prepend=-1) != 0))
    for start, end in pairwise([*starts, len(seen.frames)]):
        xy = board.corners[seen.ids[start:end], :2]
        extents = np.linalg.svd(xy - xy.mean(axis=0), compute_uv=False)
        if end - start >= MIN_CORNERS and extents[-1] > _MIN_SPREAD * extents[0]:
            out[int(seen.cameras[start]), int(seen.frames[start])] = slice(int(start), int(end))
    return out


def outlines(
    board: Board, seen: SeenCorners, views: dict[tuple[int, int], slice], sizes: list[tuple[int, int]]
) -> dict[tuple[int, int], Array]:
    """Return where the outline of the board lies in each view, (8,), in shares of the longer side of the picture."""
    out = {}
    for (camera, frame), at in views.items():
        H, _ = cv2.findHomography(board.corners[seen.ids[at], :2], seen.px[at])
        if H is not None:
            outline = cv2.perspectiveTransform(board.outline[:, None], H).ravel() / max(sizes[camera])
            # A few corners may extrapolate the outline to anywhere.
            out[camera, frame] = np.clip(outline, -1, 2)
    return out


def choose_views(outlines_of_one: dict[int, Array], most: int) -> IntArray:
    """Return frames of one camera, each as different as can be from those before; ascending."""
    return np.array(sorted(_order(outlines_of_one, most)), dtype=np.int64)


def choose_frames(outlines_of_all: dict[tuple[int, int], Array], n_cameras: int, most: int = MAX_FRAMES) -> IntArray:
    """Return frames of all cameras, ascending: pairs of cameras that share a board take turns, then single ones."""
    of_camera: list[dict[int, Array]] = [{} for _ in range(n_cameras)]
    for (camera, frame), outline in outlines_of_all.items():
        of_camera[camera][frame] = outline
    lists = []
    for a, b in combinations(range(n_cameras), 2):
        both = {
            k: np.concatenate([of_camera[a][k], of_camera[b][k]]) for k in of_camera[a].keys() & of_camera[b].keys()
        }
        lists.append(_order(both, most))
    lists += [_order(one, most) for one in of_camera]
    chosen = dict[int, None]()
    for turn in range(most):
        for frames in lists:
            if turn < len(frames) and len(chosen) < most:
                chosen[frames[turn]] = None
    return np.array(sorted(chosen), dtype=np.int64)


def _order(features: dict[int, Array], most: int) -> list[int]:
    frames = sorted(features)
    if not frames:
        return []
    return [frames[i] for i in farthest_first(np.stack([features[k] for k in frames]), most)]
