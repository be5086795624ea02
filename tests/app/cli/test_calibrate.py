"""`quadrille calibrate` on drawn pictures of a board."""

import json

import numpy as np
import pytest
from command_line import assert_refused, output_of
from drawn_boards import arc, carried, facing, filmed_folders

from tracker.calibration.boards.board_description import Board
from tracker.formats.anipose import read_calibration
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid

BOARD = Board("charuco", 4, 5, 0.1)
TOML = 'kind = "charuco"\ncolumns = 4\nrows = 5\nsquare_mm = 100\ndictionary = "DICT_4X4_50"\n'
CAMERAS = arc()
MIDDLE = np.append(-BOARD.outline.mean(axis=0), 0.0)
FLOOR = facing((0.0, 0.0, 0.6), (0.01, 0.01, 9.0)) @ rigid.transform(None, MIDDLE)
"""Pose of the board that lies on its back, as seen from above."""


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """Folders of 14 images by three cameras, a board lying flat in the last one, and its description."""
    folder = tmp_path_factory.mktemp("board")
    filmed_folders(folder, BOARD, CAMERAS, [*carried(BOARD, 13), FLOOR])
    (folder / "board.toml").write_text(TOML)
    return folder


def words(footage, out, *more, board="board.toml"):
    videos = [footage / c.name for c in CAMERAS]
    return ("calibrate", "--board", footage / board, "--videos", *videos, "--out", out, "--json", *more)


@pytest.mark.slow
def test_cameras_are_calibrated_in_the_world_of_the_floor(run, footage, tmp_path):
    record = json.loads(output_of(run(*words(footage, tmp_path / "c.toml", "--floor-frame", "13"))))
    cameras = read_calibration(tmp_path / "c.toml")
    assert [c.name for c in cameras] == [c["name"] for c in record["cameras"]] == ["cam0", "cam1", "cam2"]
    true = rigid.inverse(FLOOR @ np.diag([1.0, -1.0, -1.0, 1.0]))
    for camera, expected in zip(cameras, CAMERAS, strict=True):
        np.testing.assert_allclose(camera.center_world, rigid.apply(true, expected.center_world), atol=0.03)
        assert camera.K[0, 0] == pytest.approx(500, rel=0.02)
    assert record["expected_error_mm"] < 3
    assert record["interval_mm"][0] < record["expected_error_mm"] < record["interval_mm"][1]
    assert record["frames"] == 14
    assert record["views"] >= 30
    assert record["held_out_px"] < 0.3
    again = run(*words(footage, tmp_path / "c.toml"))
    assert_refused(again, ["expected", "c.toml not to exist, found a file", "--overwrite"])


@pytest.mark.slow
def test_a_layout_is_written_and_the_report_is_read_by_people(run, footage, tmp_path):
    given = [w for w in words(footage, tmp_path / "rig.yml", "--layout", "opencv") if w != "--json"]
    out = output_of(run(*given))
    assert "expected error in the volume of the board" in out
    assert "with 90% between" in out
    assert "the world is that of camera 'cam0', with y down: say --up -y to quadrille new" in out
    assert [e.name for e in read_cameras(tmp_path / "rig.yml").entries] == ["cam0", "cam1", "cam2"]


@pytest.mark.parametrize(
    ("change", "found"),
    [
        pytest.param(
            ("DICT_4X4_50", "DICT_5X5_100"),
            "ChArUco board of 4 x 5 squares with DICT_4X4_50 would be found",
            marks=pytest.mark.slow,
        ),
        (("kind", "inverted = true\nkind"), "ChArUco board of 4 x 5 squares with DICT_4X4_50 would be found"),
    ],
)
def test_the_right_description_is_named_where_none_is_found(run, footage, tmp_path, change, found):
    (tmp_path / "wrong.toml").write_text(TOML.replace(*change))
    result = run(*words(footage, tmp_path / "c.toml", board=tmp_path / "wrong.toml"))
    assert_refused(result, ["no view in 14 frames of 3 cameras shows six corners", found, "correct the description"])
    assert not (tmp_path / "c.toml").exists()


def test_wrong_words_are_refused_before_footage_is_read(run, footage, tmp_path):
    out = tmp_path / "c.toml"
    assert_refused(run("calibrate", "--out", out), ["--board FILE, --people KEYPOINTS or --silhouettes, found none"])
    assert_refused(
        run("calibrate", "--board", footage / "board.toml", "--out", out), ["at least two cameras, found none"]
    )
    assert_refused(run(*words(footage, tmp_path / "none" / "c.toml")), ["in a folder that exists, found none"])
    assert_refused(run(*words(footage, tmp_path)), ["not to exist, found a folder"])
    assert_refused(run(*words(footage, out, "--every", "0")), ["expected --every of at least 1, found 0"])
    assert_refused(
        run(*words(footage, out, "--fisheye", "cam9")), ["expected a fisheye lens for one of cam0", "'cam9'"]
    )
    assert_refused(run(*words(footage, out, "--floor-frame", "14")), ["frame of the floor from 0 to 13, found 14"])
    assert_refused(run(*words(footage, out, "--offset", "cam0=20")), ["expected an offset below its 14 frames"])
    assert list(tmp_path.iterdir()) == []


def test_a_stop_writes_nothing(run, footage, tmp_path, monkeypatch):
    from tracker.calibration.boards import footage_calibration

    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(footage_calibration, "calibrate_rig", stopped)
    assert run(*words(footage, tmp_path / "c.toml"))[0] not in (0, None)
    assert list(tmp_path.iterdir()) == []
