"""From footage of a board to calibrated cameras: find the corners, calibrate, and say what is missing.

Corners of a board in the footage of all cameras. Each frame is decoded once.
"""

from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.calibration.boards.board_calibration import BoardCalibration, calibrate_rig
from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_diagnosis import found_instead
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.corner_detection import NO_CORNERS, CornerDetector, Corners
from tracker.calibration.boards.view_choice import posed_views
from tracker.calibration.check.rig_adjustment import OUTLIER_SIGMAS
from tracker.compute.progress import Report, part_of, unreported
from tracker.compute.threads import map_parallel
from tracker.errors import CalibrationError
from tracker.footage.video import Footage, open_footage
from tracker.geometry import rigid
from tracker.geometry.arrays import Image, Mask
from tracker.geometry.cameras import Camera
from tracker.session.matching import camera_name, common_length, match_footage

MAX_FRAMES_READ = 600
"""Most frames in which a board is sought by default, spread over the footage: several times as many as the adjustment
takes, so that it can choose diverse ones."""
_N_SAMPLES = 6
"""Pictures of each camera that are kept to find out what is wrong where no corner is found."""


class BoardViews(NamedTuple):
    """Corners of a board in footage."""

    seen: SeenCorners
    n_views: int
    """Number of views with corners."""
    n_from_behind: int
    """Number of them that show the back of the board."""
    n_frames: int
    """Number of frames in which it was sought."""
    samples: tuple[NDArray[np.uint8], ...]
    """Some pictures of all cameras, (H, W) gray."""


def every_nth_frame(n_frames: int, every: int | None) -> range:
    """Return the frames in which to seek the board: each `every`-th, by default so that there are not too many."""
    return range(0, n_frames, every or max(1, -(-n_frames // MAX_FRAMES_READ)))


def read_corners(
    board: Board, footage: Mapping[str, Footage], offsets: Mapping[str, int], frames: range, report: Report = unreported
) -> BoardViews:
    """Find the corners in footage.

    Args:
        board: the board.
        footage: of each camera by name; camera i is the i-th.
        offsets: shifts by camera name.
        frames: where to look.
        report: receives the progress; it may raise.

    Raises:
        RecordingError: footage cannot be read.
    """
    detectors = [CornerDetector(board) for _ in footage]
    views: dict[tuple[int, int], Corners] = {}
    samples: list[NDArray[np.uint8]] = []
    sampled = {frames[i] for i in np.linspace(0, len(frames) - 1, _N_SAMPLES).round().astype(int)}

    def detect(camera: int) -> tuple[Corners, Image | None]:
        name, source = list(footage.items())[camera]
        image = source.read(k + offsets.get(name, 0))
        return (NO_CORNERS if image is None else detectors[camera].detect(image)), image

    for done, k in enumerate(frames, 1):
        for camera, (corners, image) in enumerate(map_parallel(detect, range(len(footage)))):
            if len(corners.ids):
                views[camera, k] = corners
            if k in sampled and image is not None:
                samples.append(np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8))
        report("corners", done / len(frames))
    behind = sum(corners.from_behind for corners in views.values())
    return BoardViews(seen_corners(views), len(views), behind, len(frames), tuple(samples))


def seen_corners(views: Mapping[tuple[int, int], Corners]) -> SeenCorners:
    """Return the corners of views, which are given by camera and frame, in order."""
    ordered = sorted(views.items())
    if not ordered:
        none = np.empty(0, np.int64)
        return SeenCorners(none, none, none, np.empty((0, 2)))
    return SeenCorners(
        np.concatenate([np.full(len(v.ids), camera, np.int64) for (camera, _), v in ordered]),
        np.concatenate([np.full(len(v.ids), frame, np.int64) for (_, frame), v in ordered]),
        np.concatenate([v.ids for _, v in ordered]),
        np.concatenate([v.px for _, v in ordered]),
    )


_SOLVING_FRAMES = 50
"""Number of frames that are read in the time of lenses and adjustment, for the time that is left. The 48 frames of four
real cameras (board_real) have 41; longer footage has more, up to the `MAX_FRAMES` of the adjustment."""
_TURNED = np.diag([1.0, -1.0, -1.0, 1.0])
"""From a board's axes (y down, z into the board) to those of a floor: x as before, z up."""


@dataclass(frozen=True)
class FilmedBoard:
    """Footage of a board."""

    board: Board
    videos: Sequence[Path] = ()
    """Video files or folders of images, each named after its camera."""
    camera_paths: Mapping[str, Path] = field(default_factory=dict)
    """Footage by camera name, under any file name."""
    fisheye: Collection[str] = ()
    """Names of the cameras with fisheye lenses."""
    offsets: Mapping[str, int] = field(default_factory=dict)
    """Frame k of all is frame k + offset of a camera."""
    common_frames: bool = False
    """Whether to leave out frames at the end that some cameras lack."""
    every: int | None = None
    """Look at each n-th frame; by default so that there are not too many."""
    floor_frame: int | None = None
    """Frame on which the board lies on the floor, which then defines the world, with z up."""


@dataclass(frozen=True, eq=False)
class FilmedCalibration:
    """Cameras that footage of a board has calibrated."""

    cameras: tuple[Camera, ...]
    """In the world of the floor, or of the first camera."""
    found: BoardCalibration
    """Its cameras are in the world of the first one."""
    views: BoardViews

    @property
    def is_gross(self) -> Mask:
        """Whether the adjustment took each corner of `views` for a gross error, (N,); not if it left out the frame."""
        seen, rig = self.views.seen, self.found.rig
        errors_px = np.zeros(len(seen.px))
        errors_px[np.isin(seen.frames, rig.frames)] = np.linalg.norm(rig.fit.errors_px, axis=1)
        return ~(errors_px <= OUTLIER_SIGMAS * rig.fit.sigmas_px[seen.cameras])

    def covered_share(self, camera: int) -> float:
        """Return the share of a camera's picture that lies between corners of the board in some view, 0 to 1."""
        seen = self.views.seen.of_camera(camera)
        covered = np.zeros(self.cameras[camera].size[::-1], np.uint8)
        for px in np.split(seen.px, np.flatnonzero(np.diff(seen.frames)) + 1):
            cv2.fillConvexPoly(covered, cv2.convexHull(px.round().astype(np.int32)), 1)
        return float(covered.mean())


def calibrate_footage(filmed: FilmedBoard, report: Report) -> FilmedCalibration:
    """Calibrate the cameras that have filmed a board.

    Args:
        filmed: the footage.
        report: receives the progress; it may raise to end the work.

    Raises:
        TrackerError: footage cannot be read or does not fit together, or shows too little of the board.
    """
    paths = footage_paths(filmed.videos, filmed.camera_paths, filmed.offsets, filmed.fisheye)
    with ExitStack() as stack:
        footage: dict[str, Footage] = {}
        for name, path in paths.items():
            footage[name] = open_footage(path, name)
            stack.callback(footage[name].close)
        n_frames = common_length(footage, filmed.offsets, filmed.common_frames)
        frames = every_nth_frame(n_frames, filmed.every)
        if filmed.floor_frame is not None:
            if not 0 <= filmed.floor_frame < n_frames:
                raise CalibrationError(
                    f"expected the frame of the floor from 0 to {n_frames - 1}, found {filmed.floor_frame}; correct it"
                )
            # The frame must be among those that are looked at.
            frames = range(filmed.floor_frame % frames.step, n_frames, frames.step)
        read_share = len(frames) / (len(frames) + _SOLVING_FRAMES)
        views = read_corners(filmed.board, footage, filmed.offsets, frames, part_of(report, 0.0, read_share))
        sizes = [f.size for f in footage.values()]
    _check_found(filmed.board, views, list(paths))
    fisheye = [name in filmed.fisheye for name in paths]
    found = calibrate_rig(
        filmed.board, views.seen, list(paths), sizes, fisheye, filmed.floor_frame, part_of(report, read_share, 1.0)
    )
    cameras = found.rig.cameras
    if filmed.floor_frame is not None:
        cameras = _on_floor(found, filmed.floor_frame)
    return FilmedCalibration(cameras, found, views)


def footage_paths(
    videos: Sequence[Path], camera_paths: Mapping[str, Path], offsets: Mapping[str, int], fisheye: Collection[str] = ()
) -> dict[str, Path]:
    """Return the footage by camera name; the arguments are the fields of a `FilmedBoard`.

    Raises:
        TrackerError: two videos of one camera, fewer than two cameras, or an option for a camera without footage.
    """
    names = list(dict.fromkeys([*(camera_name(v) for v in videos), *camera_paths]))
    paths = match_footage(names, videos, camera_paths) if names else {}
    if len(paths) < 2:
        raise CalibrationError(
            f"expected footage of at least two cameras, found {len(paths) or 'none'}; name a video of each camera"
        )
    for option, given in (("a fisheye lens", fisheye), ("an offset", offsets)):
        if unknown := [name for name in given if name not in paths]:
            raise CalibrationError(
                f"expected {option} for one of {', '.join(paths)}, found '{unknown[0]}'; correct the name"
            )
    return paths


def _check_found(board: Board, views: BoardViews, names: Sequence[str]) -> None:
    """Raise if no camera shows the board, with what would be found instead, or if one camera does not."""
    posed = posed_views(board, views.seen)
    seeing = {camera for camera, _ in posed}
    if not seeing:
        raise CalibrationError(
            f"no view in {views.n_frames} frames of {len(names)} cameras shows six corners of the {board.words}: "
            f"{found_instead(board, views.samples)}"
        )
    if blind := [name for i, name in enumerate(names) if i not in seeing]:
        raise CalibrationError(
            f"expected each camera to see six corners of the board, found none with camera "
            f"{', '.join(map(repr, blind))}; film the board in front of it, or leave it out"
        )


def _on_floor(found: BoardCalibration, frame: int) -> tuple[Camera, ...]:
    """Return the cameras in the world of the board on a frame, with z up: towards the cameras.

    Raises:
        CalibrationError: the board was not found on that frame.
    """
    at = np.flatnonzero(found.rig.frames == frame)
    if not len(at):
        raise CalibrationError(
            f"expected the board on the floor in frame {frame}, found too few of its corners; name another frame"
        )
    T_camera_floor = found.rig.fit.rig.own[at[0]] @ _TURNED
    T_floor_camera = rigid.inverse(T_camera_floor)
    cameras = [replace(c, T_world_camera=T_floor_camera @ c.T_world_camera) for c in found.rig.cameras]
    if np.mean([c.center_world[2] for c in cameras]) < 0:  # the board lies face down, and is seen through
        cameras = [replace(c, T_world_camera=_TURNED @ c.T_world_camera) for c in cameras]
    return tuple(cameras)
