"""A real recording of a ChArUco board by four cameras, against what Caliscope found in it."""

import csv
from collections import defaultdict

import numpy as np
import pytest

from tracker.calibration.boards.board_description import read_board
from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.footage_calibration import FilmedBoard, calibrate_footage
from tracker.calibration.boards.pose_choice import board_poses
from tracker.calibration.boards.rig_fit import held_out_errors
from tracker.footage.video import VideoFile
from tracker.formats.calibrations.reading import read_cameras

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(data_folder):
    return data_folder("board_real")


@pytest.fixture(scope="module")
def found(folder):
    """The calibration, and how often each frame of each camera was decoded."""
    counts, read = defaultdict(int), VideoFile.read

    def counted(self, k):
        counts[self.path.name, k] += 1
        return read(self, k)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(VideoFile, "read", counted)
        filmed = FilmedBoard(read_board(folder / "charuco.toml"), sorted(folder.glob("cam_*.mp4")))
        return calibrate_footage(filmed, lambda *_: None), counts


@pytest.fixture(scope="module")
def caliscopes_views(folder):
    """Corners that Caliscope found, by camera and frame.

    Camera 1 sees the back of the board. Caliscope looks at the mirrored picture, and counts the columns back from the
    width, not from the last column: its corners there lie one pixel too far to the right.
    """
    with open(folder / "timestamps.csv", encoding="utf-8") as file:
        frames = {n: k for k, n in enumerate(sorted({int(row["sync_index"]) for row in csv.DictReader(file)}))}
    views = defaultdict(dict)
    with open(folder / "xy.csv", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            px = float(row["img_loc_x"]) - (row["cam_id"] == "1"), float(row["img_loc_y"])
            views[int(row["cam_id"]), frames[int(row["sync_index"])]][int(row["keypoint_id"])] = px
    return views


def test_the_board_is_found_where_caliscope_found_it(found, caliscopes_views):
    seen = found[0].views.seen
    mine = set(zip(seen.cameras.tolist(), seen.frames.tolist(), strict=True))
    assert len(caliscopes_views) == 167
    assert len(mine & caliscopes_views.keys()) >= 0.95 * len(caliscopes_views)
    apart = [
        np.hypot(*(px - caliscopes_views[c, k][i]))
        for c, k, i, px in zip(*(rows.tolist() for rows in seen[:3]), seen.px, strict=True)
        if i in caliscopes_views.get((c, k), {})
    ]
    assert len(apart) > 1000
    assert np.median(apart) < 0.4


def test_each_frame_is_decoded_once(found):
    assert set(found[1].values()) == {1}
    assert len(found[1]) == 4 * 48


@pytest.mark.parametrize("whose", ["own", "Caliscope's"])
def test_held_out_errors_are_below_those_of_caliscopes_calibration(folder, found, caliscopes_views, whose):
    """On held-out frames, of the cameras that were fitted without them, with own corners and with Caliscope's."""
    result, board = found[0].found, read_board(folder / "charuco.toml")
    theirs = [entry.camera((1280, 720)) for entry in read_cameras(folder / "camera_array.toml").entries]
    assert [c.name for c in theirs] == [c.name for c in found[0].cameras]
    seen = result.held_out_corners
    if whose != "own":
        rows = [
            (c, k, i, px)
            for (c, k), corners in sorted(caliscopes_views.items())
            for i, px in sorted(corners.items())
            if k in result.held_out.frames
        ]
        seen = SeenCorners(*(np.array(column) for column in zip(*rows, strict=True)))
    sigmas = result.rig.fit.sigmas_px
    errors = []
    for cameras in (result.first_cameras, theirs):
        corners, off = held_out_errors(board, seen, cameras, board_poses(board, seen, *cameras), sigmas)
        assert len(corners.px) > 250
        errors.append(np.linalg.norm(off, axis=1))
    assert np.sqrt(np.mean(errors[0] ** 2)) <= np.sqrt(np.mean(errors[1] ** 2))
    assert np.median(errors[0]) <= np.median(errors[1])


def test_the_error_in_the_volume_is_told(found):
    volume = found[0].found.rig.volume
    assert 0.0001 < volume.low_m < volume.expected_m < volume.high_m < 0.002
    assert found[0].found.rig.fit.variance_inflation > 2  # the board moves while unsynchronized cameras film it
    assert found[0].views.n_from_behind == 48
