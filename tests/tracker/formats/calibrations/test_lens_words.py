"""Words of lenses: all for a fisheye are one, and unknown ones are refused by name."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from calibration_files import anipose, caliscope, opencv_words, parts, to_json
from rigs import cameras, ring

from tracker.errors import CalibrationError
from tracker.formats.calibrations.reading import read_cameras

LENS = np.array([-0.02, 0.01, -0.003, 0.001])
RIG = cameras(ring(3), LENS)


def with_words(folder, words):
    rows = []
    for c in RIG:
        K, distortion, R, t = parts(c)
        rows.append({"name": c.name, "K": K, "D": distortion, "R": R, "t": t, "size": c.size, **words})
    return to_json(folder / "cameras.json", rows)


YES = [True, 1, 1.0, "1", "true", "True", "yes", "YES"]
NO = [False, 0, 0.0, "0", "false", "no", None, "null"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        *[{"fisheye": value} for value in YES],
        {"is_fisheye": True},
        {"isFisheye": 1},
        {"fisheye_model": 1},
        {"use_fisheye": "yes"},
        {"model": "fisheye"},
        {"lens_model": "Fisheye"},
        {"lens_type": "fisheye"},
        {"distortion_type": 1},
        {"distortion_model": "kb4"},
        {"distortion_model": "equidistant"},
        {"camera_model": "KANNALA_BRANDT4"},
        {"camera_model": "OPENCV_FISHEYE"},
        {"distortionModel": "kannala-brandt"},
        {"camera_model": "pinhole", "distortion_model": "equidistant"},
        {"intrinsics": {"lens_model": "equi"}},
        {"lens": {"type": "fisheye"}},
        {"projection": "equidistant"},
        {"calibration_type": "fisheye"},
        {"intrinsics_model": "opencv_fisheye"},
    ],
    ids=str,
)
def test_all_words_of_a_fisheye(tmp_path, words):
    point = np.array([[[0.3, -0.4, 1.2]]])
    for entry, c in zip(read_cameras(with_words(tmp_path, words)).entries, RIG, strict=True):
        assert entry.fisheye
        rvec = cv2.Rodrigues(c.T_camera_world[:3, :3])[0]
        expected, _ = cv2.fisheye.projectPoints(point, rvec, c.T_camera_world[:3, 3], c.K, LENS)
        np.testing.assert_allclose(entry.camera().project(point[0]), expected[0], atol=1e-6)


@pytest.mark.parametrize("name", ["fisheye", "Equidistant", "intrinsics"])
def test_the_name_of_a_group_of_coefficients_says_the_model(tmp_path, name):
    rows = []
    for c in RIG:
        K, distortion, R, t = parts(c)
        rows.append({"name": c.name, name: {"K": K, "D": distortion}, "R": R, "t": t, "size": c.size})
    found = read_cameras(to_json(tmp_path / "cameras.json", rows)).entries
    assert [entry.fisheye for entry in found] == [name != "intrinsics"] * len(RIG)


@pytest.mark.parametrize(
    "words",
    [
        *[{"fisheye": value} for value in NO],
        {"model": "standard"},
        {"camera_model": "pinhole", "distortion_model": "plumb_bob"},
        {"distortion_model": "radtan"},
        {"distortion_type": 0},
        {"lens": "pinhole"},
        {"model": None},
        {"scale": 1.0, "binning_x": 0},
        {"reprojection_error": 0.3, "serial_number": 7, "verified_resolutions": [[1, 2]], "model_name": "MX-2"},
    ],
    ids=str,
)
def test_words_of_the_usual_lens(tmp_path, words):
    assert not any(entry.fisheye for entry in read_cameras(with_words(tmp_path, words)).entries)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ({"model": "omni"}, "model = 'omni'"),
        ({"camera_model": "mei"}, "camera_model = 'mei'"),
        ({"distortion_model": "fov"}, "distortion_model = 'fov'"),
        ({"distortion_model": "division"}, "distortion_model = 'division'"),
        ({"camera_model": "ds"}, "camera_model = 'ds'"),
        ({"camera_model": "double_sphere"}, "double_sphere"),
        ({"camera_model": "ftheta"}, "ftheta"),
        ({"distortion_model": "inverse_brown_conrady"}, "inverse_brown_conrady"),
        ({"distortion_type": 2}, "distortion_type = 2"),
        ({"fisheye": "perhaps"}, "fisheye = 'perhaps'"),
        ({"fisheye": 2}, "fisheye = 2"),
        ({"fisheye": False, "model": "kb4"}, "fisheye = False and model = 'kb4'"),
        ({"fisheye_xi": 1.2}, "'fisheye_xi'"),
        ({"xi": 1.2}, "'xi'"),
        ({"distortion_center": [1, 2]}, "'distortion_center'"),
        ({"lens_shift": 0.1}, "'lens_shift'"),
        ({"coordinate_system": "opengl"}, "'coordinate_system'"),
        ({"convention": "c2w"}, "'convention'"),
        ({"handedness": "left"}, "'handedness'"),
        ({"s1": 0.1, "s2": 0.2}, "'s1'"),
        ({"tilt": [0.1, 0.1]}, "'tilt'"),
        ({"scale": 0.5}, "'scale'"),
        ({"scale_factor": 1000}, "'scale_factor'"),
        ({"method": "cv2.fisheye.calibrate"}, "'method' = 'cv2.fisheye.calibrate'"),
        ({"comment": "an omnidirectional lens"}, "'comment'"),
        ({"radial_terms": [0.1, 0.1]}, "'radial_terms'"),
        ({"D": [0.1] * 12}, "thin prism or a tilted sensor"),
    ],
    ids=str,
)
def test_unknown_files_are_refused_by_name(tmp_path, words, named):
    with pytest.raises(CalibrationError) as caught:
        read_cameras(with_words(tmp_path, words))
    assert named in str(caught.value)
    assert "camera 'cam0'" in str(caught.value) or "camera '0'" in str(caught.value)


@pytest.mark.parametrize(
    "said",
    [
        lambda rows: {"fisheye": True, **rows},
        lambda rows: {"camera_model": "fisheye", "cameras": rows},
        lambda rows: {"metadata": {"projection": "equidistant"}, **rows},
    ],
)
def test_all_lenses_of_a_file_are_read(tmp_path, said):
    path = with_words(tmp_path, {"size": [640, 480]})
    rows = {row["name"]: row for row in json.loads(path.read_text())}
    path.write_text(json.dumps(said(rows)))
    assert all(entry.fisheye for entry in read_cameras(path).entries)
    path.write_text(json.dumps({"convention": "opengl", "cameras": rows}))
    with pytest.raises(CalibrationError, match="'convention' = 'opengl'"):
        read_cameras(path)


def test_coefficients_are_never_left_out(tmp_path):
    rows = {
        c.name: {"K": c.K, "size": c.size, "R": c.T_camera_world[:3, :3], "t": c.T_camera_world[:3, 3]} for c in RIG
    }
    lists = {"radial": [-0.3, 0.1, 0.01], "tangential": [0.001, 0.002]}
    for lens in (lists, {"distortion": {"coefficients": [-0.3, 0.1, 0.001, 0.002, 0.01]}}):
        path = to_json(tmp_path / "c.json", {name: row | lens for name, row in rows.items()})
        np.testing.assert_array_equal(read_cameras(path).entries[0].distortion, [-0.3, 0.1, 0.001, 0.002, 0.01])
    numbers = {"k1": 0.1, "k2": 0.1, "k3": 0.1, "k4": 0.1}
    path = to_json(tmp_path / "c.json", {name: row | numbers for name, row in rows.items()})
    with pytest.raises(CalibrationError, match="k1 to k4 alone, which are a fisheye's"):
        read_cameras(path)


@pytest.mark.parametrize("write", [anipose, caliscope, opencv_words])
def test_unknown_keys_in_other_layouts(tmp_path, write):
    path = write(tmp_path, RIG)
    text = path.read_text()
    path.write_text(text.replace("matrix =", 'lens_model = "omni"\nmatrix =', 1).replace('"R":', '"xi": 2, "R":', 1))
    with pytest.raises(CalibrationError, match=r"lens_model = 'omni'|'xi'"):
        read_cameras(path)
    path.write_text(text.replace("fisheye = false", "fisheye = 1"))
    fisheyes = [replace(c, fisheye=True) for c in RIG] if write is anipose else RIG
    assert [e.fisheye for e in read_cameras(path).entries] == [c.fisheye for c in fisheyes]


@pytest.mark.parametrize(
    ("pose", "named"),
    [
        ({"R": np.eye(3), "position": [1, 2, 3]}, "'position' alone"),
        ({"quaternion": [1, 0, 0, 0]}, "the rotation alone"),
        ({"rx": 1, "ry": 0, "rz": 0, "t": [1, 2, 3]}, "'rx', 'ry', 'rz' alone"),
        ({"pose": np.eye(4)}, "'pose' alone"),
        ({"R": np.eye(3)}, "the rotation alone"),
        ({"t": [1, 2, 3]}, "the translation alone"),
        ({"RT": [[1, 2], [3, 4]]}, "a matrix that is no pose alone"),
    ],
    ids=str,
)
def test_half_a_pose_is_no_absent_pose(tmp_path, pose, named):
    path = to_json(tmp_path / "c.json", {c.name: {"K": c.K, "size": c.size, **pose} for c in RIG})
    with pytest.raises(CalibrationError, match=named):
        read_cameras(path)


@pytest.mark.parametrize(
    "absent", [{}, {"R": None, "t": None}, {"R": "null", "t": "null"}, {"rvec": "", "tvec": "none"}], ids=str
)
def test_a_camera_without_a_pose_is_left_out(tmp_path, absent):
    rows = {c.name: {"K": c.K, "size": c.size} | dict(zip("Rt", parts(c)[2:], strict=True)) for c in RIG}
    path = to_json(tmp_path / "c.json", rows | {"new": {"K": RIG[0].K, "size": [640, 480], **absent}})
    reading = read_cameras(path)
    assert [e.name for e in reading.entries] == ["cam0", "cam1", "cam2"]
    assert reading.notes[0] == "Camera 'new' is left out: the calibration has no pose for it."
    path = to_json(path, {"new": {"K": RIG[0].K, "size": [640, 480], **absent}})
    with pytest.raises(CalibrationError, match=r"'new': expected its pose .*, found the lens alone"):
        read_cameras(path)


@pytest.mark.parametrize("absent", [[], [None, None, None], [float("nan")] * 3])
def test_a_pose_of_nan_is_an_absent_pose(tmp_path, absent):
    rows = {c.name: dict(zip(("K", "D", "R", "t"), parts(c), strict=True)) | {"D": None} for c in RIG}
    rows["cam1"] |= {"R": [absent] * 3, "t": absent}
    assert read_cameras(to_json(tmp_path / "c.json", rows)).left_out.keys() == {"cam1"}


def test_a_placeholder_is_no_pose(tmp_path):
    rig = cameras(ring(4))
    rows = {c.name: dict(zip(("K", "D", "R", "t"), parts(c), strict=True)) | {"D": None} for c in rig}
    rows["cam2"] |= {"R": np.eye(3), "t": [0, 0, 0]}
    with pytest.raises(CalibrationError, match="camera 'cam2': expected its pose, found no rotation"):
        read_cameras(to_json(tmp_path / "c.json", rows))


def test_rotations_in_degrees_are_refused(tmp_path):
    rows = {}
    for c in RIG:
        K, _, R, t = parts(c)
        rows[c.name] = {"K": K, "rvec": np.degrees(cv2.Rodrigues(R)[0].ravel()), "tvec": t}
    with pytest.raises(CalibrationError, match="expected a Rodrigues vector in radians, found one of length"):
        read_cameras(to_json(tmp_path / "c.json", rows))
