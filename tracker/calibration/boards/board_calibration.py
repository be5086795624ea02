"""Calibrate a rig from the corners of a board: lenses, the graph of cameras, the adjustment, and what it is worth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.camera_graph import link_cameras
from tracker.calibration.boards.rig_fit import (
    TOLD_FOCAL,
    LensFit,
    RigCalibration,
    adjust_rig,
    blank_camera,
    fit_lens,
    held_out_errors,
)
from tracker.calibration.boards.view_choice import MAX_LENS_VIEWS, choose_frames, choose_views, outlines, posed_views
from tracker.calibration.check.held_out import HeldOut, held_out_of
from tracker.calibration.check.unsolvable import check_apart, refuse_unsolvable
from tracker.compute.progress import Report, stages, unreported
from tracker.errors import CalibrationError
from tracker.geometry.cameras import Camera
from tracker.geometry.lengths import USUAL_SIZES

MIN_LENS_VIEWS = 5
"""Fewest views of the board from which a lens is fitted. Each determines two of its nine numbers (Zhang 2000, Sect.
3.1)."""

FLAT_SHARE = 0.05
"""Standard deviation of all corners across the plane that fits them best, as a share of the board's diagonal, below
which they are those of one plane. It is 0 of a board that stands, and above 0.3 of one that a person carries."""


@dataclass(frozen=True, eq=False)
class BoardCalibration:
    """Cameras that a board has calibrated."""

    rig: RigCalibration
    lenses: tuple[LensFit, ...]
    """Lens of each camera as fitted to its own views."""
    held_out: HeldOut
    """Errors of corners on frames that a first adjustment left out."""
    first_cameras: tuple[Camera, ...]
    """Cameras of the first adjustment."""
    held_out_corners: SeenCorners
    """Corners on the frames that were held out."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on quantities that the footage does not determine, and on a unit that is doubtful."""
        middle = self.rig.points_world.mean(axis=0)
        distance_m = float(np.median([np.linalg.norm(c.center_world - middle) for c in self.rig.cameras]))
        near = (
            f"the cameras stand {distance_m:.2g} m from where the board was: check the unit of its squares"
            if distance_m < USUAL_SIZES["distance"].low
            else None
        )
        return (*filter(None, [near]), *self._lens_notes)

    @property
    def _lens_notes(self) -> tuple[str, ...]:
        return tuple(
            f"camera '{lens.camera.name}': the board does not tell its focal length better than to {100 * sigma:.1f}%: "
            f"the farthest corner was {lens.depth_ratio:.1f} times as far away as the nearest; film the board nearer, "
            "farther and tilted"
            for lens, sigma in zip(self.lenses, self.rig.fit.focal_sigmas, strict=True)
            if sigma > TOLD_FOCAL
        )


def calibrate_rig(
    board: Board,
    seen: SeenCorners,
    names: Sequence[str],
    sizes: Sequence[tuple[int, int]],
    fisheye: Sequence[bool],
    needed_frame: int | None = None,
    report: Report = unreported,
) -> BoardCalibration:
    """Calibrate cameras from what they have seen of a board. The first camera defines the world.

    Args:
        board: the board.
        seen: its corners, on frames that all cameras count alike.
        names: names of the cameras.
        sizes: width and height of their pictures, px.
        fisheye: whether each has a fisheye lens.
        needed_frame: a frame that the adjustment takes whatever it shows.
        report: receives the progress.

    Raises:
        CalibrationError: a camera sees the board too seldom, or shares no board with the others, or the views do not
            determine the cameras.
    """
    # Cameras of the usual sizes are fitted, of which the priors and the nearest plane know.
    scale = 1.0 if board.square_m >= USUAL_SIZES["square"].low else board.square_m / USUAL_SIZES["square"].high
    board = replace(board, square_m=board.square_m / scale)
    blanks = [blank_camera(n, s, fisheye=f) for n, s, f in zip(names, sizes, fisheye, strict=True)]
    with refuse_unsolvable("film the board in many places, nearer, farther and tilted"):
        found = _calibrated(board, seen, blanks, needed_frame, report)
    _check_determined(found, board)
    return found if scale == 1.0 else replace(found, rig=found.rig.scaled(scale))


def _calibrated(
    board: Board, seen: SeenCorners, blanks: Sequence[Camera], needed_frame: int | None, report: Report
) -> BoardCalibration:
    """Calibrate cameras from a board of a usual size; the arguments are those of `calibrate_rig`."""
    fitting, adjusting, checking = stages(report, "lenses", "all cameras", "frames held out")
    views = outlines(board, seen, posed_views(board, seen), [blank.size for blank in blanks])
    lenses = []
    for i, blank in enumerate(blanks):
        frames = choose_views({k: o for (camera, k), o in views.items() if camera == i}, MAX_LENS_VIEWS)
        if len(frames) < MIN_LENS_VIEWS:
            raise CalibrationError(
                f"expected at least {MIN_LENS_VIEWS} views of camera '{blank.name}' that show six corners of the "
                f"board, found {len(frames)}; film the board in front of it"
            )
        lenses.append(fit_lens(board, seen.of_camera(i), blank, frames))
        fitting((i + 1) / len(blanks))
    Ts, poses = link_cameras(board, seen, [lens.camera for lens in lenses])
    start = [replace(lens.camera, T_world_camera=T) for lens, T in zip(lenses, Ts, strict=True)]
    sigmas = np.array([lens.sigma_px for lens in lenses])
    frames = choose_frames(views, len(blanks))
    held_out = held_out_of(frames)
    if needed_frame is not None:
        frames = np.union1d(frames, [needed_frame])
    first = adjust_rig(board, seen.in_frames(np.setdiff1d(frames, held_out)), start, blanks, poses, sigmas)
    adjusting(0.5)
    rig = adjust_rig(board, seen.in_frames(frames), first.cameras, blanks, poses, sigmas)
    adjusting(1.0)
    corners, errors = held_out_errors(board, seen.in_frames(held_out), first.cameras, poses, rig.fit.sigmas_px)
    checking(1.0)
    errors_on_them = HeldOut(held_out, corners.cameras, np.linalg.norm(errors, axis=1))
    return BoardCalibration(rig, tuple(lenses), errors_on_them, first.cameras, corners)


def _check_determined(found: BoardCalibration, board: Board) -> None:
    """Check that the views determine the cameras, as far as their covariance and the places of the board show it.

    Raises:
        CalibrationError: two cameras stand at one place, the board stood still or stayed in one plane, or a focal
            length is as good as unknown.
    """
    check_apart(found.rig.cameras)
    points = found.rig.points_world - found.rig.points_world.mean(axis=0)
    thickness_m = float(np.linalg.svd(points, compute_uv=False)[-1] / np.sqrt(len(points)))
    extent_m = float(np.linalg.norm(np.ptp(board.outline, axis=0)))
    if thickness_m < FLAT_SHARE * extent_m:
        raise CalibrationError(
            f"expected the board in many places and tilts, found all its corners within {100 * thickness_m:.1g} cm of "
            f"one plane, of a board {100 * extent_m:.0f} cm across: it stood still or was moved in its plane, which "
            "tells neither focal lengths nor distances; film it nearer, farther and tilted"
        )
    worst = int(np.argmax(found.rig.fit.focal_sigmas))
    if (sigma := float(found.rig.fit.focal_sigmas[worst])) > 10 * TOLD_FOCAL:
        raise CalibrationError(
            f"expected views that tell the focal length of camera '{found.rig.cameras[worst].name}' to "
            f"{1000 * TOLD_FOCAL:.0f}% at least, found a standard deviation of {100 * sigma:.0f}%: what it sees fits "
            "a nearer board and a shorter lens as well; film the board nearer, farther and tilted in front of it"
        )
