"""`quadrille calibrate --people` on key points of simulated people."""

import json
import shutil

import cv2
import numpy as np
import pytest
from command_line import assert_refused, output_of
from detected_people import danced, detected
from filmed_people import FOCAL_PX, NAMES, SIZE, STATURE_M, dancing, observed, rig
from observed_files import write_deeplabcut
from observed_people import BODY_25, write_openpose

from tracker.formats.anipose import read_calibration, write_calibration

N_FRAMES = 10
CAMERAS = rig(3)


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """Folders of black images, the key points in the layout of OpenPose, and the lenses."""
    folder = tmp_path_factory.mktemp("person")
    for camera in CAMERAS:
        (folder / camera.name).mkdir()
        for k in range(N_FRAMES):
            cv2.imwrite(str(folder / camera.name / f"{k:04d}.png"), np.zeros((SIZE[1], SIZE[0]), np.uint8))
    points = observed(CAMERAS, dancing(N_FRAMES)).points
    rows = np.zeros((N_FRAMES, len(CAMERAS), 1, len(BODY_25.points), 3))
    at = [BODY_25.points.index(name) for name in NAMES]
    rows[:, :, :, at] = np.nan_to_num(np.concatenate([points.points_px, points.confidence[..., None]], axis=-1))
    write_openpose(folder / "keypoints", [c.name for c in CAMERAS], rows)
    write_calibration(folder / "lenses.toml", CAMERAS)
    write_people(folder)
    return folder


def write_people(folder):
    """Key points of two people: by name in the layout of DeepLabCut, and in that of OpenPose."""
    several = detected(CAMERAS, danced(N_FRAMES), tracks=[["animal0", "animal1"]] * len(CAMERAS)).points
    rows = np.concatenate([several.points_px, several.confidence[..., None]], axis=-1)
    write_openpose(folder / "crowd", [c.name for c in CAMERAS], np.nan_to_num(rows))
    for v, camera in enumerate(CAMERAS):
        named = np.full((N_FRAMES, 2, *rows.shape[3:]), np.nan)
        for person in range(2):
            frames, places = np.nonzero(several.tracks[:, v] == f"animal{person}")
            named[frames, person] = rows[frames, v, places]
        write_deeplabcut(folder / "named" / camera.name, BODY_25.points, named, "multi")


def words(footage, out, *more, files="keypoints"):
    videos = [footage / c.name for c in CAMERAS]
    return ("calibrate", "--people", footage / files, "--videos", *videos, "--out", out, *more)


@pytest.mark.slow
def test_several_people_are_reported(run, footage, tmp_path):
    heights = ("--height", f"animal0={STATURE_M}", f"animal1={STATURE_M}", "--lenses", footage / "lenses.toml")
    record = json.loads(output_of(run(*words(footage, tmp_path / "c.toml", *heights, "--json", files="named"))))
    assert [person["name"] for person in record["people"]] == ["animal0", "animal1"]
    assert all(8 <= person["frames"] <= N_FRAMES for person in record["people"])
    assert (record["pictures_left_out"], record["exchanged"]) == (0, 0)
    text = output_of(run(*words(footage, tmp_path / "d.toml", *heights, files="named")))
    assert "joints of 2 people in 10 frames\n  people: animal0 in 10 frames, animal1 in 10 frames\n" in text
    assert "below them" in text


def test_wrong_people_are_refused(run, footage, tmp_path):
    out = tmp_path / "c.toml"
    assert_refused(
        run(*words(footage, out, files="crowd")),
        ["pictures show several people and were left out, because not all files name the people", "film one person"],
    )
    assert_refused(
        run(*words(footage, out, "--height", "eve=1.7", files="named")),
        ["people whom the files name, found 'eve' and the people animal0, animal1"],
    )
    assert_refused(
        run(*words(footage, out, "--height", "1.7", "1.8", files="named")),
        ["--height once for all people, or as NAME=VALUE for each, found 1.7 and 1.8"],
    )
    videos = [footage / c.name for c in CAMERAS]
    assert_refused(
        run("calibrate", "--silhouettes", "--videos", *videos, "--out", out, "--height", "ann=1.7"),
        ["expected one height for silhouettes"],
    )
    assert not out.exists()


@pytest.mark.slow
def test_a_calibration_is_written_and_reported(run, footage, tmp_path):
    out = tmp_path / "c.toml"
    text = output_of(run(*words(footage, out, "--height", STATURE_M, "--json")))
    record, cameras = json.loads(text), read_calibration(out)
    assert [c.name for c in cameras] == [c["name"] for c in record["cameras"]] == ["cam0", "cam1", "cam2"]
    assert cameras[0].K[0, 0] == pytest.approx(FOCAL_PX, rel=0.05)
    apart = np.linalg.norm(cameras[0].center_world - cameras[1].center_world)
    assert apart == pytest.approx(np.linalg.norm(CAMERAS[0].center_world - CAMERAS[1].center_world), rel=0.05)
    assert record["frames"] == N_FRAMES
    assert record["interval_mm"][0] < record["expected_error_mm"] < record["interval_mm"][1] < 30
    assert record["held_out_frames"] == 2
    assert 2 < record["scale_sigma_percent"] < 4


@pytest.mark.slow
def test_lenses_are_taken_and_a_lacking_height_is_said(run, footage, tmp_path):
    out = tmp_path / "c.toml"
    text = output_of(run(*words(footage, out, "--lenses", footage / "lenses.toml")))
    assert read_calibration(out)[2].K[0, 0] == FOCAL_PX
    assert "focal length   500.0 px, as given" in text
    assert "no height was given: the scale is that of a person of 1.75 m and may be off by 7%" in text
    assert "the world has z up" in text


@pytest.mark.slow
def test_footage_without_a_person_is_refused(run, footage, tmp_path):
    videos = [footage / c.name for c in CAMERAS]
    result = run("calibrate", "--silhouettes", "--videos", *videos, "--out", tmp_path / "c.toml", "--json")
    assert_refused(result, ["one whole person in camera 'cam0'", "10 show nobody", "where the cameras see the same"])
    assert list(tmp_path.iterdir()) == []


def test_wrong_words_are_refused(run, footage, tmp_path):
    out = tmp_path / "c.toml"
    assert_refused(run(*words(footage, out, "--board", footage / "lenses.toml")), ["found --board and --people"])
    assert_refused(run(*words(footage, out, "--silhouettes")), ["found --people and --silhouettes"])
    assert_refused(run(*words(footage, out, "--floor-frame", "3")), ["expected --floor-frame together with --board"])
    assert_refused(
        run("calibrate", "--board", "b.toml", "--height", "1.7", "--out", out),
        ["expected --height together with --people"],
    )
    assert_refused(
        run(*words(footage, out, "--height", "175")),
        ["of 0.6 to 2.3 metres, found 175; is it in centimetres? say 1.75"],
    )
    shutil.copytree(footage / "cam0", tmp_path / "other")
    assert_refused(run(*words(footage, out, "--camera", f"other={tmp_path / 'other'}")), ["none of other", "leave out"])
    (tmp_path / "one.toml").write_text((footage / "lenses.toml").read_text().replace("cam1", "cam9"))
    assert_refused(run(*words(footage, out, "--lenses", tmp_path / "one.toml")), ["expected the lens of camera 'cam1'"])
    assert not out.exists()
