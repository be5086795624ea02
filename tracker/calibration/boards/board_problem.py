"""Poses of a board and the cameras that see it, as a least-squares problem."""

from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.check.rig_adjustment import Located, Observations, Prior, ReprojectionProblem
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray, Mask


class SeenCorners(NamedTuple):
    """Corners of a board that cameras have seen, sorted by camera and frame."""

    cameras: IntArray
    """Index of the camera of each, (N,)."""
    frames: IntArray
    """Its frame, (N,)."""
    ids: IntArray
    """Its index in `Board.corners`, (N,)."""
    px: Array
    """Its place, original px, (N, 2)."""

    def where(self, chosen: Mask) -> "SeenCorners":
        """Return some of them, by a mask, (N,)."""
        return SeenCorners(self.cameras[chosen], self.frames[chosen], self.ids[chosen], self.px[chosen])

    def of_camera(self, camera: int) -> "SeenCorners":
        """Return those of one camera, whose index becomes 0."""
        chosen = self.where(self.cameras == camera)
        return chosen._replace(cameras=np.zeros_like(chosen.cameras))

    def in_frames(self, frames: IntArray) -> "SeenCorners":
        """Return those of some frames."""
        return self.where(np.isin(self.frames, frames))


class BoardProblem(ReprojectionProblem):
    """A board in one pose per frame: each is a group with six unknowns, a turn about the board's origin and a shift."""

    n_own = 6

    def __init__(self, board: Board, seen: SeenCorners, frames: IntArray, prior: Prior, sigmas_px: Array) -> None:
        """State a problem.

        Args:
            board: the board.
            seen: corners, all on `frames`.
            frames: the frames, ascending; the pose of each is determined by the corners.
            prior: knowledge of the cameras.
            sigmas_px: standard deviation of a corner in each camera, (n_cameras,), px.
        """
        self.frames = frames
        groups = np.searchsorted(frames, seen.frames)
        super().__init__(Observations(seen.cameras, groups, seen.px), prior, len(frames), sigmas_px)
        self._corners_board = board.corners[seen.ids]

    def locate(self, own: Array) -> Located:
        """See `ReprojectionProblem`."""
        Ts = own[self.observations.groups]
        turned = (Ts[:, :3, :3] @ self._corners_board[:, :, None])[..., 0]
        by_own = np.concatenate([-rigid.skew(turned), np.broadcast_to(np.eye(3), (len(turned), 3, 3))], axis=2)
        return Located(turned + Ts[:, :3, 3], by_own)

    def move_own(self, own: Array, step: Array) -> Array:
        """See `ReprojectionProblem`."""
        out = own.copy()
        out[:, :3, :3] = rigid.so3_exp(step[:, :3]) @ own[:, :3, :3]
        out[:, :3, 3] += step[:, 3:]
        return out
