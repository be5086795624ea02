"""All cameras and all poses of the board in one adjustment, and what it is worth on frames that it has not seen.

The lens of one camera, from its own views of the board.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import BoardProblem, SeenCorners
from tracker.calibration.boards.expected_error import MAX_POINTS, VolumeAccuracy, expected_error
from tracker.calibration.boards.pose_choice import Poses, best_poses, board_poses, posed_frames
from tracker.calibration.check.lens_priors import UNKNOWN_LENS, prior_sigmas
from tracker.calibration.check.rig_adjustment import Prior, Rig, RigFit, fit_rig, plain_errors_px
from tracker.compute.sampling import spread_indices
from tracker.estimation.fitting.bundle import ROUGH, solve_bundle
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.camera_rig import scaled_cameras
from tracker.geometry.cameras import Camera


class RigCalibration(NamedTuple):
    """Calibrated cameras, and what is known of their errors."""

    cameras: tuple[Camera, ...]
    fit: RigFit
    frames: IntArray
    """Frames of the adjustment, ascending, (F,)."""
    volume: VolumeAccuracy
    points_world: Array
    """Corners of the board on those frames, the volume in which the error is expected, (P, 3), metres."""

    def scaled(self, scale: float) -> "RigCalibration":
        """Return the cameras of a world that is larger by a factor; their covariance is that of before."""
        own = self.fit.rig.own.copy()
        own[:, :3, 3] *= scale
        cameras = scaled_cameras(self.cameras, scale)
        volume = VolumeAccuracy(*(scale * error for error in self.volume))
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


_FOCAL_STARTS = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)
"""Focal lengths from which a lens is fitted, in longer sides of the picture: horizontal fields of view from 110 to 19
degrees, in steps from which the fit falls to the same minimum."""
_RADIAL_STARTS = (-0.3, 0.0)
"""First radial coefficients from which it is fitted: without the barrel distortion of a wide lens, the fit can end at a
focal length 20% too short (camera 0 of `board_real`)."""
_TRIAL_STEPS, _TRIAL_VIEWS = 12, 20
"""Steps and views of the fit from each of them before the best one goes on."""
_START_SIGMA_PX = 1.0
"""Standard deviation of corners before it is measured, px: errors of good starts then keep their influence."""
_CHOICES = 2
"""Times that the poses of the board are chosen with the lens of before."""
TOLD_FOCAL = 0.01
"""Standard deviation of a focal length, as a share of it, from which on the user is warned: 1% too long moves the
points of one camera by 3 cm at 3 m along its axis. Ten times as much is refused: 30 cm are no measure of a person."""


class LensFit(NamedTuple):
    """A lens and the poses of the board in front of it."""

    camera: Camera
    """At the origin, looking along z."""
    sigma_px: float
    """Measured standard deviation of a corner along each axis, px."""
    focal_sigma: float
    """Standard deviation of the focal length, as a share of it."""
    depth_ratio: float
    """How many times as far as the nearest corner the farthest one is."""
    n_views: int
    """Number of views that it was fitted to."""


def blank_camera(name: str, size: tuple[int, int], focal: float = 1.0, fisheye: bool = False) -> Camera:
    """Return a camera at the origin with a lens as unknown lenses are on average.

    Args:
        name: of the camera.
        size: of its picture, px.
        focal: focal length in longer sides of the picture.
        fisheye: whether its lens follows the equidistant model.
    """
    f = focal * max(size)
    K = np.array([[f, 0.0, (size[0] - 1) / 2], [0.0, f, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera(name, size, K, np.zeros(4 if fisheye else 5), np.eye(4), fisheye)


def fit_lens(board: Board, seen: SeenCorners, blank: Camera, frames: IntArray) -> LensFit:
    """Fit the lens of one camera.

    Coefficients of distortion that the corners do not determine stay near 0 by their priors (`UNKNOWN_LENS`).

    Args:
        board: the board.
        seen: corners of this camera, as camera 0.
        blank: its size and the model of its lens.
        frames: frames to use, ascending; each determines a pose of the board.
    """
    chosen = seen.in_frames(frames)
    prior = Prior((blank,), (prior_sigmas(blank, UNKNOWN_LENS, pose=False),))
    few = frames[spread_indices(len(frames), _TRIAL_VIEWS)]
    problem = BoardProblem(board, chosen, frames, prior, np.array([_START_SIGMA_PX]))
    trials = BoardProblem(board, chosen.in_frames(few), few, prior, problem.sigmas_px)
    found = []
    for camera in _first_lenses(blank):
        own = best_poses(trials, [camera], board_poses(board, chosen, camera))
        found.append(solve_bundle(trials, Rig((camera,), own), _TRIAL_STEPS, ROUGH))
    camera = min(found, key=lambda trial: trial.cost).state.cameras[0]

    def fitted(problem: BoardProblem, camera: Camera) -> RigFit:
        own = best_poses(problem, [camera], board_poses(board, chosen, camera))
        return fit_rig(problem, Rig((camera,), own))

    fit = fitted(problem, camera)
    for _ in range(1, _CHOICES):
        problem = problem.with_sigmas(fit.sigmas_px)
        fit = fitted(problem, fit.rig.cameras[0])
    return _lens_fit(problem.with_sigmas(fit.sigmas_px), fit, len(frames))


def _first_lenses(blank: Camera) -> Iterator[Camera]:
    """Yield the camera with each of the lenses from which the fit begins."""
    for focal in _FOCAL_STARTS:
        for radial in (0.0,) if blank.fisheye else _RADIAL_STARTS:
            distortion = np.zeros_like(blank.distortion)
            # The picture bends by k1 r^2, with r in focal lengths: long lenses show little of it.
            distortion[0] = radial * min(1.0, focal) ** 2
            yield replace(blank, K=blank_camera("", blank.size, focal).K, distortion=distortion)


def _lens_fit(problem: BoardProblem, fit: RigFit, n_views: int) -> LensFit:
    depths = problem.locate(fit.rig.own).points_world[:, 2]
    ratio = float(depths.max() / max(TINY, depths.min()))
    return LensFit(fit.rig.cameras[0], float(fit.sigmas_px[0]), float(fit.focal_sigmas[0]), ratio, n_views)
