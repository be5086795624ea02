"""Poses of all cameras from boards that they share: the graph of cameras, and its maximum spanning tree."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.pose_choice import Poses, board_poses
from tracker.calibration.boards.view_choice import posed_views
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

_CAP = 0.1
"""Largest error that counts in the choice of a relative pose, in longer sides of the picture. Lenses that are 10% off
move points in the corners of a picture by less."""
MIN_SHARED = 3
"""Fewest frames that link two cameras. Of the two poses of a board that look alike, one frame does not show the right
one, and two frames may disagree."""


class Link(NamedTuple):
    """Relative pose of two cameras."""

    T_a_b: Array
    n_corners: int
    """Number of corners that both cameras have seen, on the frames that it explains."""


def link_cameras(board: Board, seen: SeenCorners, cameras: Sequence[Camera]) -> tuple[list[Array], Poses]:
    """Find the poses of cameras with known lenses in the frame of the first one.

    Args:
        board: the board.
        seen: its corners.
        cameras: at the origin, with their lenses.

    Returns:
        `T_world_camera` of each, (4, 4), and the poses of the board in front of them.

    Raises:
        CalibrationError: a camera shares too few boards with the others.
    """
    poses = board_poses(board, seen, *cameras)
    links = {
        (i, j): _link(board, seen, poses, cameras[i], cameras[j], (i, j))
        for i, j in combinations(range(len(cameras)), 2)
    }
    found = {pair: link for pair, link in links.items() if link is not None}
    return _spanned(found, [c.name for c in cameras]), poses


def _link(board: Board, seen: SeenCorners, poses: Poses, a: Camera, b: Camera, pair: tuple[int, int]) -> Link | None:
    """Return the relative pose of two cameras that explains most of what both see; None if they share too few boards.

    Each pose of a board in one camera is combined with each in the other. The best combination carries the boards of
    all frames into the picture of the second camera with the smallest errors.
    """
    views = posed_views(board, seen)
    frames = [k for camera, k in poses if camera == pair[0] and (pair[1], k) in poses]
    if len(frames) < MIN_SHARED:
        return None
    boards_a = [poses[pair[0], k] for k in frames]
    candidates = [
        T_a_board @ rigid.inverse(T_b_board)
        for T_as, k in zip(boards_a, frames, strict=True)
        for T_a_board in T_as
        for T_b_board in poses[pair[1], k]
    ]
    errors = np.zeros((len(candidates), len(frames)))
    cap_px = _CAP * max(b.size)
    for j, (T_as, k) in enumerate(zip(boards_a, frames, strict=True)):
        at = views[pair[1], k]
        corners, px = board.corners[seen.ids[at]], seen.px[at]
        points = np.stack([rigid.apply(T, corners) for T in T_as])
        for i, T_a_b in enumerate(candidates):
            off = np.linalg.norm(b.project(rigid.apply(rigid.inverse(T_a_b), points)) - px, axis=-1)
            errors[i, j] = np.minimum(np.nan_to_num(off / cap_px, nan=1.0), 1.0).mean(axis=1).min()
    counts = np.array([min(n.stop - n.start for n in (views[c, k] for c in pair)) for k in frames])
    best = int(np.argmin(errors @ counts))
    return Link(candidates[best], int(counts[errors[best] < 1 / 2].sum()))


def _spanned(links: Mapping[tuple[int, int], Link], names: Sequence[str]) -> list[Array]:
    """Follow the links with most corners from the first camera to all others (Prim)."""
    Ts: dict[int, Array] = {0: np.eye(4)}
    while len(Ts) < len(names):
        open_links = [pair for pair in links if (pair[0] in Ts) != (pair[1] in Ts)]
        if not open_links:
            raise CalibrationError(_unlinked(set(Ts), names))
        a, b = max(open_links, key=lambda pair: links[pair].n_corners)
        if a in Ts:
            Ts[b] = Ts[a] @ links[a, b].T_a_b
        else:
            Ts[a] = Ts[b] @ rigid.inverse(links[a, b].T_a_b)
    return [Ts[i] for i in range(len(names))]


def _unlinked(reached: set[int], names: Sequence[str]) -> str:
    """Return the sentence on cameras that share no board with the others; the smaller group is named first."""
    rest = set(range(len(names))) - reached
    if len(rest) > len(reached):
        reached, rest = rest, reached
    # Of the rest, those that are linked to one another need one link together.
    lone = ", ".join(f"'{names[i]}'" for i in sorted(rest))
    others = " or ".join(f"'{names[i]}'" for i in sorted(reached))
    kind = "camera" if len(rest) == 1 else "cameras"
    return (
        f"expected each camera to see the board together with another one in {MIN_SHARED} frames or more, found fewer "
        f"with {kind} {lone}; film the board where {lone.replace(', ', ' or ')} and {others} see it together, "
        "also in part"
    )
