"""What each program may say besides its cameras: lenses that are not read, halves, directions, and files of others."""

import json
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest
from calibration_files import (
    calib_io,
    colmap,
    dlt,
    egoexo,
    google,
    lines,
    mayacam1,
    mayacam2,
    mvhumannet,
    rig_for,
    skeletool,
    to_json,
    wildtrack,
    xrmocap,
)
from rigs import cameras, looking

from tracker.errors import CalibrationError
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid

RIG = cameras([looking(p) for p in ([4.0, 0.3, 1.5], [0.2, 3.5, 2.0], [-4.0, 0.0, 1.7])], (-0.12, 0.03, 0.001, 0.0))
POINTS = np.random.default_rng(0).uniform((-0.6, -0.6, 0.4), (0.6, 0.6, 1.6), (20, 3))


def changed(path, *changes):
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    return path


def assert_read(path, rig, **options):
    for entry, expected in zip(read_cameras(path, **options).entries, rig, strict=True):
        np.testing.assert_allclose(entry.camera(expected.size).project(POINTS), expected.project(POINTS), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("radial      0", "radial      0.2"), r"Skeletool's lens model \(radial\)"),
        (("radial      0", "polynomial  2 1 0.5"), r"Skeletool's lens model \(polynomial\)"),
        (("animated    0", "animated    1"), "moves during the recording"),
    ],
)
def test_lenses_of_skeletool_are_left_out_by_name(tmp_path, change, reason):
    reading = read_cameras(changed(skeletool(tmp_path, rig_for(skeletool, RIG)), change))
    assert [e.name for e in reading.entries] == ["cam1", "cam2"]

    assert re.search(reason, reading.left_out["cam0"])


def test_a_camera_of_skeletool_is_there_once(tmp_path):
    path = changed(skeletool(tmp_path, rig_for(skeletool, RIG)), ("name          cam1", "name          cam0"))
    with pytest.raises(CalibrationError, match="two cameras are named 'cam0'"):
        read_cameras(path)


def test_words_of_skeletool_may_be_apart_by_tabs(tmp_path):
    rig = rig_for(skeletool, RIG)
    path = skeletool(tmp_path, rig)
    path.write_text(re.sub(r"  +(?=\S+ )|(?<=\S)  +", "\t", path.read_text()))
    assert_read(path, rig)


def test_the_first_mayacam_has_1024_pixels_where_it_says_none(tmp_path):
    rig = [replace(c, size=(1024, 1024)) for c in rig_for(mayacam1, RIG)]
    for path in mayacam1(tmp_path, rig).iterdir():
        changed(path, (",1024,1024", ",0,0"))
    assert_read(tmp_path, rig)


def test_coefficients_whose_rows_are_counted_from_the_bottom_are_refused(tmp_path):
    rig = rig_for(dlt, RIG)
    path = dlt(tmp_path, rig)
    L = np.loadtxt(path, delimiter=",")
    turned = L.copy()
    turned[4:8] = 479 * np.vstack([L[8:], np.ones(3)]) - L[4:8]
    np.savetxt(path, turned, delimiter=",", fmt="%.17g")
    with pytest.raises(CalibrationError, match=r"counted from the bottom.*\(height - 1\) times rows"):
        read_cameras(path)
    turned[4:8] = 479 * np.vstack([turned[8:], np.ones(3)]) - turned[4:8]  # as the message says
    np.savetxt(path, turned, delimiter=",", fmt="%.17g")
    assert_read(path, rig)


def test_decimal_commas_of_coefficients_apart_by_semicolons(tmp_path):
    rig = rig_for(dlt, RIG)
    path = dlt(tmp_path, rig)
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))
    assert_read(path, rig)


@pytest.mark.parametrize(
    ("model", "lens", "distortion", "fisheye"),
    [
        ("SIMPLE_PINHOLE", "500 320 240", (0, 0, 0, 0), False),
        ("SIMPLE_RADIAL", "500 320 240 0.1", (0.1, 0, 0, 0), False),
        ("RADIAL", "500 320 240 0.1 0.02", (0.1, 0.02, 0, 0), False),
        (
            "FULL_OPENCV",
            "500 500 320 240 1e-1 2e-2 3e-3 4e-4 5e-3 0 0 0",
            (0.1, 0.02, 3e-3, 4e-4, 5e-3, 0, 0, 0),
            False,
        ),
        ("RADIAL_FISHEYE", "500 320 240 0.1 0.02", (0.1, 0.02, 0, 0), True),
        ("OPENCV_FISHEYE", "500 500 320 240 0.1 0.02 0.03 0.04", (0.1, 0.02, 0.03, 0.04), True),
    ],
)
def test_lenses_of_colmap(tmp_path, model, lens, distortion, fisheye):
    path = colmap(tmp_path, RIG)
    lines(path, [f"{i + 1} {model} 640 480 {lens}" for i in range(3)])
    assert_read(path, [replace(c, distortion=np.array(distortion, float), fisheye=fisheye) for c in RIG])


def test_parts_of_colmap(tmp_path):
    path = colmap(tmp_path, RIG)
    changed(path, ("1 OPENCV", "1 FOV"))
    assert "COLMAP's lens FOV" in read_cameras(path).left_out["cam0"]
    changed(path, ("1 FOV", "7 OPENCV"))
    assert "has no lens; give the cameras.txt" in read_cameras(tmp_path / "images.txt").left_out["cam0"]
    (tmp_path / "images.txt").unlink()
    with pytest.raises(CalibrationError, match=r"has no pose; give the images\.txt"):
        read_cameras(path)


def test_pictures_of_colmap_in_folders_of_cameras(tmp_path):
    path = colmap(tmp_path, RIG)
    changed(tmp_path / "images.txt", ("cam0.png", "left/0001.png"), ("cam1.png", "right/0001.png"))
    assert [e.name for e in read_cameras(path).entries] == ["left", "right", "cam2"]
    changed(tmp_path / "images.txt", ("right/0001.png", "left/0002.png"))
    with pytest.raises(CalibrationError, match="two cameras are named 'left'"):
        read_cameras(path)


def test_pictures_of_colmap_in_one_folder_are_named_by_themselves(tmp_path):
    path = colmap(tmp_path, RIG)
    changed(tmp_path / "images.txt", *((f"cam{i}.png", f"images/cam{i}.png") for i in range(3)))
    assert_read(path, RIG)
    assert [e.name for e in read_cameras(path).entries] == ["cam0", "cam1", "cam2"]


def test_fisheyes_of_calib_io_have_four_coefficients(tmp_path):
    rig = [replace(c, distortion=np.array([0.1, 0.02, 0.03, 0.04]), fisheye=True) for c in rig_for(calib_io, RIG)]
    path = calib_io(tmp_path, rig)
    data = json.loads(path.read_text().replace("CameraModelOpenCV", "CameraModelKannalaBrandt"))
    for camera, c in zip(data["Calibration"]["cameras"], rig, strict=True):
        lens = camera["model"]["ptr_wrapper"]["data"]["parameters"]
        own = {"k1", "k2", "k3", "k4", "f", "ar", "cx", "cy"}
        lens |= {f"k{i + 1}": {"val": float(k)} for i, k in enumerate(c.distortion)}
        camera["model"]["ptr_wrapper"]["data"]["parameters"] = {key: lens[key] for key in own}
    path.write_text(json.dumps(data))
    assert_read(path, rig)


def test_another_lens_of_ego_exo4d_is_left_out(tmp_path):
    path = changed(egoexo(tmp_path, rig_for(egoexo, RIG)), ("KANNALABRANDTK3", "FISHEYE624"))
    assert "lens 'FISHEYE624', not KANNALABRANDTK3" in read_cameras(path).left_out["cam0"]


def test_directions_of_xrmocap(tmp_path):
    assert_read(xrmocap(tmp_path, RIG, world2cam=False), RIG)
    for path in tmp_path.iterdir():
        changed(path, ('"opencv"', '"pytorch3d"'))
    with pytest.raises(CalibrationError, match="OpenCV's axes, found 'convention' = 'pytorch3d'"):
        read_cameras(sorted(tmp_path.iterdir()))


def test_fisheyes_and_single_files_of_googles_rigs(tmp_path):
    rig = [replace(c, fisheye=True, distortion=np.array([0.1, 0.02, 0.0, 0.0])) for c in RIG]
    rows = json.loads(google(tmp_path, rig).read_text())
    for row in rows:
        row["projection_type"] = "fisheye"
        row["radial_distortion"] = [0.1, 0.02, 0.0]
        del row["tangential_distortion"]
    assert_read(to_json(tmp_path / "models.json", rows), rig)
    rows = json.loads(google(tmp_path, RIG).read_text())
    files = [to_json(tmp_path / f"{row.pop('name')}.json", row) for row in rows]
    assert_read(files, RIG)


def test_a_camera_of_a_list_is_there_once(tmp_path):
    path = changed(google(tmp_path, RIG), ('"cam1"', '"cam0"'))
    with pytest.raises(CalibrationError, match="two cameras are named 'cam0'"):
        read_cameras(path)


def test_another_model_of_calib_io_is_refused(tmp_path):
    path = changed(calib_io(tmp_path, RIG), ("CameraModelOpenCV", "CameraModelDoubleSphere"))
    with pytest.raises(CalibrationError, match="found model = 'DoubleSphere'"):
        read_cameras(path)


@pytest.mark.parametrize("data", [None, b"", b"no pickle", pickle.dumps("1.8"), pickle.dumps([1.0, 2.0])])
def test_the_scale_of_mvhumannet_is_needed(tmp_path, data):
    path = mvhumannet(tmp_path, rig_for(mvhumannet, RIG))
    scale = path.with_name("camera_scale.pkl")
    scale.unlink() if data is None else scale.write_bytes(data)
    with pytest.raises(CalibrationError, match=r"expected camera_scale\.pkl of MVHumanNet beside it"):
        read_cameras(path)


def test_one_half_of_wildtrack_finds_the_other(tmp_path):
    wildtrack(tmp_path, RIG)
    assert_read(tmp_path / "extr_cam1.xml", RIG[1:2])
    assert_read(sorted(tmp_path.iterdir()), RIG)


@pytest.mark.parametrize(
    ("name", "data", "found"),
    [
        ("a.json", {"camera_matrix": [1], "distortion_model": "plumb_bob", "projection_matrix": [1]}, "ROS writes it"),
        ("a.json", {"value0": {"T_imu_cam": [], "intrinsics": []}}, "the cameras of Basalt"),
        ("a.json", {"30": {"input": {}, "world": {"rotation": [0, 0, 0]}}}, "ZED cameras without their lenses"),
        ("a.pickle", {"cam-a": {"cameraMatrix1": np.eye(3)}}, "DeepLabCut 3D; write both cameras"),
        ("cameras.bin", {}, "binary model of COLMAP"),
    ],
)
def test_programs_that_are_not_read_are_named(tmp_path, name, data, found):
    path = tmp_path / name
    path.write_bytes(json.dumps(data).encode() if name != "a.pickle" else pickle.dumps(data))
    with pytest.raises(CalibrationError, match=found):
        read_cameras(path)


@pytest.mark.parametrize("write", [mayacam1, mayacam2])
def test_millimetres_of_mayacam_are_asked_about(tmp_path, write):
    rig = rig_for(write, RIG)
    in_mm = [replace(c, T_world_camera=rigid.transform(c.T_world_camera[:3, :3], 10 * c.center_world)) for c in rig]
    path = write(tmp_path, in_mm)
    with pytest.raises(CalibrationError, match=r"so that the unit may be another") as caught:
        read_cameras(path)
    assert re.match(r"mm \([34]", caught.value.remedy.fields["units"])
    assert_read(path, rig, units="mm")
    assert_read(path, in_mm, units="cm")


def test_a_folder_of_mvhumannet_is_read(tmp_path):
    rig = rig_for(mvhumannet, RIG)
    path = mvhumannet(tmp_path, rig)
    to_json(tmp_path / "camera_intrinsics.json", {"K": rig[0].K, "dist": [0.0] * 5})
    assert path.parent == tmp_path
    assert_read(tmp_path, rig)


@pytest.mark.parametrize(
    ("name", "data", "found"),
    [
        ("cameras.bin", bytes(8), r"a binary model of COLMAP; export it as text"),
        ("stereo_params.pickle", pickle.dumps({"cam0-cam1": {"cameraMatrix1": 1}}), "DeepLabCut 3D; write both"),
    ],
)
def test_folders_of_files_that_are_not_read_are_named(tmp_path, name, data, found):
    (tmp_path / "a.mp4").write_bytes(b"no calibration")
    (tmp_path / name).write_bytes(data)
    with pytest.raises(CalibrationError, match=found):
        read_cameras(tmp_path)
