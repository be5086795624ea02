"""Voxels at the command line: `track --method voxel` and `init --method voxels`, their options and refusals."""

import json

import pytest
from command_line import SAMPLE, assert_refused, output_of, stored


@pytest.mark.slow
def test_track_by_voxels(run, placed):
    words = ("track", placed, "--frames", "20:23", "--method", "voxel", "--voxel-size", "50", "--sizes", "frozen")
    out = output_of(run(*words, "--json"))
    assert json.loads(out)["frames"] == 3
    poses = stored(placed)
    assert {poses[k].settings["method"] for k in (21, 22)} == {"voxel"}


@pytest.mark.slow
def test_options_of_other_methods_are_refused(run, placed):
    before = sorted(stored(placed))
    for words, expected in (
        (("--method", "voxel", "--theta", "20"), "'voxel', found --theta"),
        (("--method", "voxel", "--order", "1", "--window", "4"), "'voxel', found --order, --window"),
        (("--voxel-size", "30"), "'chamfer', found --voxel-size"),
        (("--method", "contour", "--sizes", "always"), "'contour', found --sizes"),
        (("--method", "voxel", "--voxel-size", "0"), "a number from 10 to 100 as 'voxel_size', found 0"),
        (("--method", "voxel", "--voxel-size", "nan"), "found nan"),
        (("--method", "voxel", "--paper"), "the paper's body mikic10"),
    ):
        assert_refused(run("track", placed, "--frames", "20:22", *words), [expected])
        assert sorted(stored(placed)) == before


def test_init_by_voxels_refuses_sizes_that_show_no_limbs(run, session):
    for size in ("0", "-5", "500"):
        expected = f"voxels of 10 to 100 mm, found {size} mm"
        assert_refused(run("init", session, "--method", "voxels", "--frame", "3", "--voxel-size", size), [expected])
    assert not (session / "annotations.sqlite").exists()


@pytest.mark.slow
def test_people_are_not_searched_with_one_camera(run, tmp_path):
    words = ("new", tmp_path / "s", "--calibration", SAMPLE / "calibration.toml", "--videos", SAMPLE / "FRONT.mp4")
    out = output_of(run(*words))
    assert "note: one camera shows no depth" in out
    expected = ["two cameras or more to find people", "'FRONT' alone", "by hand, or set it from known joints"]
    for method in ("voxels", "axis", "auto"):
        assert_refused(run("init", tmp_path / "s", "--method", method), expected)
    assert run("init", tmp_path / "s", "--joints", SAMPLE / "truth.trc")[0] == 0
