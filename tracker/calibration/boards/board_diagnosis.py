"""Find out with which other description a board would be found, where no corner was."""

import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.calibration.boards.board_description import DICTIONARIES, Board
from tracker.calibration.boards.corner_detection import CornerDetector
from tracker.compute.sampling import spread_indices

_N_DESCRIBED = 4
"""Corners in a picture from which on another description counts: fewer may be found by chance."""
_MAX_SIDE = 14
"""Largest number of squares along a side that is tried: markers of larger boards are small in most pictures."""
_HIDDEN = 2
"""Markers with the highest numbers that may be covered in all pictures."""
_MAX_SAMPLES = 8
"""Pictures that are looked at: each takes a second for all descriptions."""
_MAX_TILT_PX = 3.0
"""Distance from a flat grid within which a corner agrees with the others, px: lenses bend a board by as much."""


def found_instead(board: Board, samples: Sequence[NDArray[np.uint8]]) -> str:
    """Return a sentence on which board some pictures show; it says where nothing was tried with success.

    Args:
        board: as described; it was not found.
        samples: pictures, (H, W) gray.
    """
    samples = [samples[i] for i in spread_indices(len(samples), _MAX_SAMPLES)]
    n_tried, best, most = 0, board, 0
    for other in _others(board, samples):
        n_tried += 1
        found = sum(_n_agreeing(other, image) >= _N_DESCRIBED for image in samples)
        if found > most:
            best, most = other, found
        if 2 * most > len(samples):
            break
    if most:
        return (
            f"a {best.words} would be found in {most} of {len(samples)} pictures; correct the description "
            "of the board if it is that one"
        )
    return (
        f"{n_tried} other descriptions (black and white exchanged, other sets of markers and numbers of squares) "
        "find none either; check that the videos show the board, large and sharp enough"
    )


def _others(board: Board, samples: Sequence[NDArray[np.uint8]]) -> Iterator[Board]:
    """Yield other descriptions, likeliest first."""
    yield replace(board, inverted=not board.inverted)
    if board.kind == "checkerboard":
        for columns in range(max(3, board.columns - 2), board.columns + 3):
            for rows in range(max(3, board.rows - 2), board.rows + 3):
                if (columns, rows) != (board.columns, board.rows):
                    yield replace(board, columns=columns, rows=rows)
        return
    yield replace(board, legacy=not board.legacy)
    for inverted in (board.inverted, not board.inverted):
        dictionary, n_markers = _best_dictionary(samples, inverted)
        if not n_markers:
            continue
        named = replace(board, dictionary=dictionary, inverted=inverted)
        yield named
        yield replace(named, columns=board.rows, rows=board.columns)
        # A marker lies in every second square.
        for columns in range(3, _MAX_SIDE + 1):
            for rows in range(3, _MAX_SIDE + 1):
                if n_markers <= columns * rows // 2 <= n_markers + _HIDDEN:
                    yield replace(named, columns=columns, rows=rows)


def _best_dictionary(samples: Sequence[NDArray[np.uint8]], inverted: bool) -> tuple[str, int]:
    """Return the set of which most markers are found, and the largest number of one plus 1; 0 if none is found.

    Small sets are parts of larger ones, so that the smallest set wins a tie.
    """
    best, most, largest = "", 0, 0
    sizes = {name: re.fullmatch(r"DICT_\dX\d_(\d+)", name) for name in DICTIONARIES}
    for name in sorted(DICTIONARIES, key=lambda n: int(size[1]) if (size := sizes[n]) else sys.maxsize):
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name)))
        found = [detector.detectMarkers(_as_described(image, inverted))[1] for image in samples]
        ids = np.concatenate([np.zeros(0, int), *(i.ravel() for i in found if i is not None)])
        # Markers that are found by chance have any number, and each in one picture only.
        repeated = [i for i in set(ids.tolist()) if np.sum(ids == i) > 1 or len(samples) == 1]
        if len(repeated) > most:
            best, most, largest = name, len(repeated), int(max(repeated)) + 1
    return best, largest


def _as_described(image: NDArray[np.uint8], inverted: bool) -> NDArray[np.uint8]:
    return np.asarray(cv2.bitwise_not(image), np.uint8) if inverted else image


def _n_agreeing(board: Board, image: NDArray[np.uint8]) -> int:
    """Return how many corners are found that lie as on a flat grid: with wrong numbers of squares, few do."""
    corners = CornerDetector(board).detect(image)
    if len(corners.ids) < _N_DESCRIBED:
        return 0
    H, agree = cv2.findHomography(board.corners[corners.ids, :2], corners.px, cv2.RANSAC, _MAX_TILT_PX)
    return 0 if H is None else int(np.sum(agree))
