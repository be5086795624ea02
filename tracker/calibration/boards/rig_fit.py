"""All cameras and all poses of the board in one adjustment, and what it is worth on frames that it has not seen."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import BoardProblem, SeenCorners
from tracker.calibration.boards.expected_error import MAX_POINTS, VolumeError, expected_error
from tracker.calibration.boards.pose_choice import Poses, best_poses, posed_frames
from tracker.calibration.check.lens_priors import UNKNOWN_LENS, prior_sigmas
from tracker.calibration.check.reprojection import Prior, Rig, RigFit, fit_rig, plain_errors_px
from tracker.compute.sampling import spread_indices
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera


class RigCalibration(NamedTuple):
    """Calibrated cameras, and what is known of their errors."""

    cameras: tuple[Camera, ...]
    fit: RigFit
    frames: IntArray
    """Frames of the adjustment, ascending, (F,)."""
    volume: VolumeError
    points_world: Array
    """Corners of the board on those frames, the volume in which the error is expected, (P, 3), metres."""

    def scaled(self, scale: float) -> "RigCalibration":
        """Return the cameras of a world that is larger by a factor; their covariance is that of before."""
        own = self.fit.rig.own.copy()
        own[:, :3, 3] *= scale
        cameras = scaled_cameras(self.cameras, scale)
        volume = VolumeError(*(scale * error for error in self.volume))
        fit = self.fit._replace(rig=Rig(cameras, own))
        return RigCalibration(cameras, fit, self.frames, volume, scale * self.points_world)


def adjust_rig(
    board: Board, seen: SeenCorners, lenses: Sequence[Camera], blanks: Sequence[Camera], poses: Poses, sigmas_px: Array
) -> RigCalibration:
    """Fit all cameras and all poses of the board.

    Args:
        board: the board.
        seen: its corners on the frames to use.
        lenses: cameras with first lenses and poses; the first one stays where it is and defines the world.
        blanks: the same cameras with the means of what is known of lenses (`UNKNOWN_LENS`).
        poses: of the board in front of the cameras.
        sigmas_px: first standard deviation of a corner in each camera, (n_cameras,), px.
    """
    frames = posed_frames(poses, seen)
    seen = seen.in_frames(frames)
    means = tuple(replace(b, T_world_camera=c.T_world_camera) for b, c in zip(blanks, lenses, strict=True))
    sigmas = tuple(prior_sigmas(c, UNKNOWN_LENS, pose=i > 0) for i, c in enumerate(means))
    problem = BoardProblem(board, seen, frames, Prior(means, sigmas), sigmas_px)
    own = best_poses(problem, lenses, poses)
    fit = fit_rig(problem, Rig(tuple(lenses), own))
    # Poses that look alike differ by less than the errors of the first lenses.
    problem = problem.with_sigmas(fit.sigmas_px)
    own = best_poses(problem, fit.rig.cameras, poses, fit.rig.own)
    fit = fit_rig(problem, Rig(fit.rig.cameras, own))
    points = problem.locate(fit.rig.own).points_world
    few = points[spread_indices(len(points), MAX_POINTS)]
    return RigCalibration(fit.rig.cameras, fit, frames, expected_error(fit.rig.cameras, fit.covariance, few), few)


def held_out_errors(
    board: Board, seen: SeenCorners, cameras: Sequence[Camera], poses: Poses, sigmas_px: Array
) -> tuple[SeenCorners, Array]:
    """Return the errors of cameras on frames that they were not fitted to.

    The board's pose is fitted to all corners of a frame by plain least squares; nothing else moves.

    Args:
        board: the board.
        seen: its corners on the held-out frames.
        cameras: the calibrated cameras.
        poses: of the board in front of the cameras.
        sigmas_px: standard deviation of a corner in each camera, (n_cameras,), px.

    Returns:
        The corners, and projection minus corner of each, (N, 2), px.
    """
    frames = posed_frames(poses, seen)
    seen = seen.in_frames(frames)
    if not len(frames):
        return seen, np.empty((0, 2))
    problem = BoardProblem(board, seen, frames, Prior.held(cameras), sigmas_px)
    return seen, plain_errors_px(problem, Rig(tuple(cameras), best_poses(problem, cameras, poses)))
