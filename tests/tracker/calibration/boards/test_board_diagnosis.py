"""Which description of a board would find it, where the given one does not."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_boards import arc, carried, drawn

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.board_diagnosis import found_instead

CHARUCO = Board("charuco", 4, 5, 0.1)
CHECKERS = Board("checkerboard", 7, 6, 0.08)


def pictures(board):
    return [drawn(board, arc()[1], T) for T in carried(board, 4)]


@pytest.mark.parametrize(
    ("board", "change"),
    [
        pytest.param(CHARUCO, {"columns": 5, "rows": 4}, marks=pytest.mark.slow),
        pytest.param(CHARUCO, {"columns": 6, "rows": 8}, marks=pytest.mark.slow),
        (CHARUCO, {"inverted": True}),
        pytest.param(CHECKERS, {"columns": 8, "rows": 7}, marks=pytest.mark.slow),
    ],
)
def test_the_right_board_is_named(board, change):
    sentence = found_instead(replace(board, **change), pictures(board))
    turned = replace(board, columns=board.rows, rows=board.columns)  # a checkerboard is the same
    same = [board] if board.kind == "charuco" else [board, turned]
    assert any(f"a {b.words} would be found in" in sentence for b in same)


def test_pictures_without_a_board_say_so():
    sentence = found_instead(CHARUCO, [np.full((480, 640), 120, np.uint8)])
    assert "find none either; check that the videos show the board" in sentence
