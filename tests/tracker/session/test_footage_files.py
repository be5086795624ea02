"""Parts of a recording that are found in its folder."""

import shutil

import pytest
from command_line import SAMPLE

from tracker.session.footage_files import SideParts, footage_in, side_parts


@pytest.fixture
def recording(tmp_path):
    """A recording with its videos in a folder of their own, and what lies beside them."""
    shutil.copy(SAMPLE / "calibration.toml", tmp_path / "Calib.toml")
    for path in ("videos/a.mp4", "Background/a.png", "masks/a/000000.png"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    return tmp_path


@pytest.mark.parametrize("chosen", ["", "videos"])
def test_parts_are_found_from_the_folder_and_from_its_videos(recording, chosen):
    assert footage_in(recording / chosen) == [recording / "videos/a.mp4"]
    assert side_parts(recording / chosen) == SideParts(
        recording / "Calib.toml", recording / "Background", recording / "masks"
    )


def test_a_background_is_no_camera(recording):
    shutil.rmtree(recording / "videos")
    (recording / "cam1").mkdir()
    (recording / "cam1/0.png").touch()
    assert footage_in(recording) == [recording / "cam1"]


def test_parts_that_are_not_there_are_none(tmp_path):
    assert side_parts(tmp_path) == SideParts(None, None, None)
