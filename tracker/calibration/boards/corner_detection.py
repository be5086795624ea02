"""Find the corners of a board in a picture, by OpenCV."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.calibration.boards.board_description import Board
from tracker.geometry.arrays import Array, Image, IntArray

_REFINE_STEPS = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 0.001
"""End of the refinement: 40 steps, or a step below a thousandth of a pixel."""
_REFINE_SHARE = 0.8
"""Half the side of the window in which a corner is refined, as a share of the gap between corner and marker: edges of
a marker in the window would pull the corner, by 0.3 px at twice this size (`test_corner_detection.py`)."""
_REFINE_PX = 2, 11
"""Least and largest half of that side, px: 5 by 5 pixels have two edges, and 23 by 23 are more than noise needs."""


class Corners(NamedTuple):
    """Corners of a board in a picture."""

    ids: IntArray
    """Indices into `Board.corners`, ascending, (n,)."""
    px: Array
    """Original px, (n, 2)."""
    from_behind: bool
    """Whether the picture shows the back of the board, mirrored: of a transparent one, or one printed on both sides."""


NO_CORNERS = Corners(np.empty(0, np.int64), np.empty((0, 2)), False)
"""A picture without a board."""


class CornerDetector:
    """Detects the corners of one board. Not for several threads at a time."""

    def __init__(self, board: Board) -> None:
        """Prepare the detection."""
        self.board = board
        self._size = board.columns - 1, board.rows - 1
        self._charuco = _charuco_detector(board) if board.kind == "charuco" else None

    def detect(self, image: Image) -> Corners:
        """Find the corners in a picture, (H, W, 3) RGB or (H, W).

        A ChArUco board may be partly visible, or be seen from behind. A checkerboard must be visible as a whole.
        """
        gray = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image
        gray = np.asarray(cv2.bitwise_not(gray) if self.board.inverted else gray, np.uint8)
        if self._charuco is None:
            return self._checkerboard(gray)
        found = self._charuco_corners(gray)
        if len(found.ids) < len(self.board.corners) / 2:
            mirrored = self._charuco_corners(np.ascontiguousarray(gray[:, ::-1]))
            if len(mirrored.ids) > len(found.ids):
                found = Corners(mirrored.ids, mirrored.px * (-1, 1) + (gray.shape[1] - 1, 0), True)
        if not len(found.ids):
            return NO_CORNERS
        return found._replace(px=_refined(gray, found.px, (1 - self.board.marker_share) / 2))

    def _charuco_corners(self, gray: NDArray[np.uint8]) -> Corners:
        assert self._charuco is not None
        px, ids, _, _ = self._charuco.detectBoard(gray)
        if ids is None or not len(ids):
            return NO_CORNERS
        order = np.argsort(ids.ravel())
        return Corners(ids.ravel()[order].astype(np.int64), px.reshape(-1, 2)[order].astype(np.float64), False)

    def _checkerboard(self, gray: NDArray[np.uint8]) -> Corners:
        is_found, px = cv2.findChessboardCornersSB(gray, self._size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not is_found:
            return NO_CORNERS
        grid = px.reshape(self._size[1], self._size[0], 2).astype(np.float64)
        # Rows and columns turn as x and y of the picture do, for a board that is seen from the front.
        along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        if along[0] * down[1] - along[1] * down[0] < 0:
            grid = grid[:, ::-1]
        # The inner square beside the first corner is black, like that of the corner of the board.
        if _brightness(gray, grid[:2, :2]) > _brightness(gray, grid[:2, 1:3]):
            grid = grid[::-1, ::-1]
        return Corners(np.arange(grid.shape[0] * grid.shape[1]), grid.reshape(-1, 2), False)


def _charuco_detector(board: Board) -> cv2.aruco.CharucoDetector:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    size = (board.columns, board.rows)
    drawn = cv2.aruco.CharucoBoard(size, board.square_m, board.marker_share * board.square_m, dictionary)
    drawn.setLegacyPattern(board.legacy)
    detector = cv2.aruco.CharucoDetector(drawn)
    settings = detector.getCharucoParameters()
    settings.tryRefineMarkers = True
    detector.setCharucoParameters(settings)
    return detector


def _refined(gray: NDArray[np.uint8], px: Array, gap: float) -> Array:
    """Move corners to the saddle of brightness near them; `gap` is that before the markers, in sides of a square."""
    if len(px) < 2:
        return px
    apart = np.linalg.norm(px[:, None] - px[None], axis=2)
    nearest = float(np.median(np.sort(apart, axis=1)[:, 1]))
    half = int(np.clip(round(_REFINE_SHARE * gap * nearest), *_REFINE_PX))
    start = np.ascontiguousarray(px, np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(gray, start.copy(), (half, half), (-1, -1), _REFINE_STEPS).reshape(-1, 2)
    moved = np.linalg.norm(found - px, axis=1)
    return np.asarray(np.where(moved[:, None] <= half, found, px), np.float64)


def _brightness(gray: NDArray[np.uint8], corners: Array) -> float:
    """Return the brightness in the middle of a square, of its corners (2, 2, 2), px."""
    u, v = np.clip(np.round(corners.mean(axis=(0, 1))), 0, np.array(gray.shape[::-1]) - 1).astype(int)
    return float(gray[max(0, v - 1) : v + 2, max(0, u - 1) : u + 2].mean())
