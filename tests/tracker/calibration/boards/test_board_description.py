"""Descriptions of boards: Caliscope's, anipose's and the project's own, and wrong ones."""

import re

import numpy as np
import pytest

from tracker.calibration.boards.board_description import Board, read_board
from tracker.errors import CalibrationError

CALISCOPE = """
columns = 4
rows = 5
board_height = 11.0
board_width = 8.5
dictionary = "DICT_4X4_1000"
units = "inch"
aruco_scale = 0.75
square_size_override_cm = 5.4
inverted = true
legacy_pattern = false
"""
ANIPOSE = """
nesting = 1
[calibration]
board_type = "charuco"
board_size = [10, 7]
board_marker_bits = 4
board_marker_dict_number = 50
board_marker_length = 18.75
board_square_side_length = 25
fisheye = false
"""
PLAIN = 'kind = "checkerboard"\ncolumns = 9\nrows = 6\nsquare_mm = 40\n'
PRINTED = CALISCOPE.replace("square_size_override_cm = 5.4\n", "")
"""A board whose squares follow from the size of the paper."""
CORNERS = ANIPOSE.replace('"charuco"', '"checkerboard"').replace("[10, 7]", "[8, 5]")
"""Anipose counts the inner corners of checkerboards."""
MARKERS = PLAIN.replace("checkerboard", "charuco") + 'marker_mm = 20\ndictionary = "DICT_5X5_100"\n'


def read(tmp_path, text):
    path = tmp_path / "board.toml"
    path.write_text(text)
    return read_board(path)


SIZES = [
    ("board_square_side_length = 0.06\nboard_marker_length = 0.045", "found 0.06; is it in metres? say 60"),
    ("board_square_side_length = 1\nboard_marker_length = 0.75", "is it in inches or centimetres? say 25.4 or 10"),
    ("board_square_side_length = 2000\nboard_marker_length = 10", "of 5 to 300 millimetres, found 2000"),
]


@pytest.mark.parametrize(("lengths", "expected"), SIZES)
def test_squares_in_another_unit_are_refused(tmp_path, lengths, expected):
    path = tmp_path / "config.toml"
    path.write_text(f'[calibration]\nboard_type = "charuco"\nboard_size = [7, 5]\n{lengths}\n')
    with pytest.raises(CalibrationError, match=re.escape(expected)) as caught:
        read_board(path)
    assert caught.value.remedy.code == "any_size"
    assert read_board(path, any_size=True).columns == 7


@pytest.mark.parametrize(("side", "expected"), [("0.06", "metres? say 60"), ("2.36", "centimetres? say 59.9 or 23.6")])
def test_sides_of_our_own_form_in_another_unit_are_refused(tmp_path, side, expected):
    with pytest.raises(CalibrationError, match=re.escape(f"found {side}; is it in ") + ".*" + re.escape(expected)):
        read(tmp_path, PLAIN.replace("square_mm = 40", f"square_mm = {side}"))


def test_the_unit_of_caliscope_is_centimetres(tmp_path):
    path = tmp_path / "charuco.toml"
    path.write_text('columns = 5\nrows = 7\ndictionary = "DICT_4X4_50"\nsquare_size_override_cm = 54\n')
    with pytest.raises(CalibrationError, match=r"of 0\.5 to 30 centimetres, found 54; is it in millimetres\? say 5\.4"):
        read_board(path)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CALISCOPE, Board("charuco", 4, 5, 0.054, 0.75, "DICT_4X4_1000", True)),
        (f"camera_count = 4\n[charuco]{CALISCOPE}", Board("charuco", 4, 5, 0.054, 0.75, "DICT_4X4_1000", True)),
        (PRINTED, Board("charuco", 4, 5, 0.0254 * 8.5 / 4, 0.75, "DICT_4X4_1000", True)),
        (ANIPOSE, Board("charuco", 10, 7, 0.025, 0.75, "DICT_4X4_50")),
        (CORNERS, Board("checkerboard", 9, 6, 0.025)),
        (PLAIN, Board("checkerboard", 9, 6, 0.04)),
        (MARKERS, Board("charuco", 9, 6, 0.04, 0.5, "DICT_5X5_100")),
    ],
)  # fmt: skip
def test_a_board_is_read(tmp_path, text, expected):
    found = read(tmp_path, text)
    assert found.square_m == pytest.approx(expected.square_m)
    assert (found.kind, found.columns, found.rows) == (expected.kind, expected.columns, expected.rows)
    assert (found.dictionary, found.inverted, found.legacy) == (expected.dictionary, expected.inverted, expected.legacy)
    assert found.marker_share == pytest.approx(expected.marker_share)


def test_corners_are_those_between_squares():
    board = Board("charuco", 4, 5, 0.1)
    assert board.corners.shape == (12, 3)
    np.testing.assert_allclose(board.corners[[0, 2, 3]], [[0.1, 0.1, 0], [0.3, 0.1, 0], [0.1, 0.2, 0]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (PLAIN.replace("columns = 9\n", ""), "expected the key 'columns', found none"),
        (PLAIN.replace("9", "1"), "expected a whole number from 2 to 100 as 'columns', found 1"),
        (PLAIN.replace("rows = 6", "rows = 7"), "looks the same turned by 180 degrees; cover one row"),
        (PLAIN + "sqare = 3\n", "found 'sqare'"),
        (PLAIN.replace("checkerboard", "charuco"), "expected the set of markers as 'dictionary', found none"),
        (PLAIN + "marker_mm = 50\n", "expected 'marker_mm' below 'square_mm'"),
        (CALISCOPE.replace("1000", "999"), "found 'DICT_4X4_999'"),
        (PRINTED.replace("board_width = 8.5\n", ""), "as 'square_size_override_cm', found none; measure it"),
        (ANIPOSE.replace("18.75", "30"), "expected markers smaller than the squares"),
        (ANIPOSE.replace("dict_number = 50", "dict_number = 70"), "found DICT_4X4_70"),
        ("= 3", "is not valid TOML"),
    ],
)  # fmt: skip
def test_a_wrong_description_is_refused(tmp_path, text, words):
    with pytest.raises(CalibrationError) as caught:
        read(tmp_path, text)
    assert words in str(caught.value)
    assert str(caught.value).startswith("board ")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CalibrationError, match="not found; check the path"):
        read_board(tmp_path / "none.toml")
