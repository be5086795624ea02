"""Corners of a board in the footage of all cameras. Each frame is decoded once."""

from collections.abc import Mapping
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.corner_detection import NO_CORNERS, CornerDetector, Corners
from tracker.compute.progress import Report, unreported
from tracker.compute.threads import map_parallel
from tracker.footage.video import Footage
from tracker.geometry.arrays import Image

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


def every_frame(n_frames: int, every: int | None) -> range:
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
