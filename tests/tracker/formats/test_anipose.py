import re

import cv2
import numpy as np
import pytest
import tomli_w

from tracker.errors import CalibrationError
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera


def section(**changes):
    good = {
        "name": "front",
        "size": [640.0, 480.0],
        "matrix": [[500.0, 0.0, 320.0], [0.0, 510.0, 240.0], [0.0, 0.0, 1.0]],
        "distortions": [0.1, -0.05, 0.001, 0.002],
        "rotation": [0.1, 0.2, 0.3],
        "translation": [0.5, -0.25, 4.0],
        "fisheye": False,
    }
    return {k: v for k, v in (good | changes).items() if v is not None}


@pytest.fixture
def write(tmp_path):
    def _write(data):
        path = tmp_path / "Calib.toml"
        path.write_text(data if isinstance(data, str) else tomli_w.dumps(data))
        return path

    return _write


def test_reads_what_opencv_projects(write):
    (camera,) = read_calibration(write({"cam01": section()}))
    points = np.array([[0.1, 0.2, 0.3], [-0.4, 0.3, 1.0], [1.0, 0.5, -0.5]])
    s = section()
    expected, _ = cv2.projectPoints(
        points, np.array(s["rotation"]), np.array(s["translation"]), np.array(s["matrix"]), np.array(s["distortions"])
    )
    np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=1e-9)
    assert camera.name == "front"
    assert camera.size == (640, 480)


def test_section_order_is_kept_and_metadata_is_no_camera(write):
    path = write(
        {
            "zeta": section(name=None),
            "alpha": section(name=None),
            "metadata": {"adjusted": False, "error": 0.0},
            "mid": section(name=None),
        }
    )
    assert [c.name for c in read_calibration(path)] == ["zeta", "alpha", "mid"]


@pytest.mark.parametrize("count", [0, 4, 5, 8])
def test_distortion_counts(write, count):
    (camera,) = read_calibration(write({"cam01": section(distortions=[0.01] * count)}))
    assert camera.distortion.shape == (count,)


def test_a_fisheye_lens_is_read_and_written_back(write, tmp_path):
    (camera,) = read_calibration(write({"cam01": section(fisheye=True)}))
    points, s = np.array([[0.1, 0.2, 0.3], [-0.4, 0.3, 1.0], [3.0, 0.5, -0.5]]), section()
    expected, _ = cv2.fisheye.projectPoints(
        points[:, None],
        np.array(s["rotation"]),
        np.array(s["translation"]),
        np.array(s["matrix"]),
        np.array(s["distortions"]),
    )
    np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=1e-9)
    write_calibration(tmp_path / "again.toml", [camera])
    (again,) = read_calibration(tmp_path / "again.toml")
    assert again.fisheye
    np.testing.assert_allclose(again.project(points), expected[:, 0], atol=1e-6)


def test_absent_distortions_are_none(write):
    (camera,) = read_calibration(write({"cam01": section(distortions=None)}))
    assert camera.is_pinhole


def test_rotation_matrix_is_accepted(write):
    R = rigid.so3_exp(np.array(section()["rotation"]))
    (matrix,) = read_calibration(write({"cam01": section(rotation=np.round(R, 5).tolist())}))
    (vector,) = read_calibration(write({"cam01": section()}))
    np.testing.assert_allclose(matrix.T_world_camera, vector.T_world_camera, atol=1e-4)
    np.testing.assert_allclose(matrix.T_world_camera[:3, :3] @ matrix.T_camera_world[:3, :3], np.eye(3), atol=1e-12)


def test_camera_that_defines_the_world_may_stand_at_the_origin(write):
    path = write({"cam01": section(translation=[0.0, 0.0, 0.0])})
    assert read_calibration(path)[0].center_world == pytest.approx([0, 0, 0])


def test_round_trip(tmp_path):
    rng = np.random.default_rng(0)
    cameras = [
        Camera(
            name,
            (1920, 1080),
            np.array([[1500.0, 0.5, 959.5], [0.0, 1501.0, 539.5], [0.0, 0.0, 1.0]]),
            rng.normal(0, 0.05, n),
            rigid.transform(rigid.so3_exp(rng.normal(0, 1.5, 3)), rng.normal(0, 3, 3)),
        )
        for name, n in (("b 2", 0), ("a.1", 4), ("c", 5), ("ü", 8))
    ]
    write_calibration(tmp_path / "out.toml", cameras)
    for old, new in zip(cameras, read_calibration(tmp_path / "out.toml"), strict=True):
        assert (new.name, new.size) == (old.name, old.size)
        np.testing.assert_allclose(new.T_world_camera, old.T_world_camera, atol=1e-12)
        np.testing.assert_array_equal(new.K, old.K)
        np.testing.assert_array_equal(new.distortion, old.distortion)
    assert [p.name for p in tmp_path.iterdir()] == ["out.toml"]


def test_half_turn_survives_the_round_trip(tmp_path):
    # At pi the Rodrigues vector's sign is open: the rotation must come back all the same.
    R = np.diag([1.0, -1.0, -1.0])
    camera = Camera(
        "down", (64, 48), np.diag([50.0, 50.0, 1.0]), np.zeros(0), rigid.transform(R, np.array([0, 0, 3.0]))
    )
    write_calibration(tmp_path / "out.toml", [camera])
    np.testing.assert_allclose(read_calibration(tmp_path / "out.toml")[0].T_world_camera[:3, :3], R, atol=1e-12)


@pytest.mark.parametrize("name", ["balance_real", "walk", "fast_arms", "two_people"])
def test_reads_the_footage_at_hand(data_folder, name):
    cameras = read_calibration(data_folder(name) / "Calib.toml")
    assert len(cameras) == 4
    assert all(1 < np.linalg.norm(c.center_world) < 10 for c in cameras)
    assert all(c.center_world[2] > 0 for c in cameras)  # above the floor


SKEWED = [[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]]
MIRROR = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"rotation": SKEWED}, "not a rotation"),
        ({"rotation": MIRROR}, "determinant -1"),
        ({"rotation": [0.1, 0.2]}, "Rodrigues vector of 3 values"),
        ({"rotation": [float("nan"), 0.0, 0.0]}, "rotation: expected a finite number"),
        ({"translation": [float("inf"), 0.0, 0.0]}, r"finite number within 1e9 as 'translation\[0\]', found inf"),
        ({"translation": [0.0, 1.0]}, "3 finite numbers as 'translation'"),
        ({"translation": ["a", 1.0, 2.0]}, r"number within 1e9 as 'translation\[0\]', found 'a'"),
        ({"fisheye": True, "distortions": [0.0] * 5}, "expected 0 or 4 fisheye values as 'distortions', found 5"),
        ({"matrix": [[500.0, 0.0, 320.0], [0.0, -1.0, 240.0], [0.0, 0.0, 1.0]]}, "positive fx and fy"),
        ({"matrix": [[500.0, 0.0, 320.0], [0.0, 500.0, 240.0]]}, "fx, skew, cx"),
        ({"matrix": [[500.0, 0.0], [0.0]]}, "fx, skew, cx"),
        ({"distortions": [0.0, 0.0, 0.0]}, "0, 4, 5 or 8 values"),
        ({"size": [640.5, 480.0]}, "whole pixels"),
        ({"size": [640, 0]}, "whole pixels"),
        ({"size": [640, 10**400]}, "whole pixels"),
        ({"size": [640, True]}, "whole pixels"),
        ({"rotation": [[1.0, 0.0, 0.0], 2.0, 3.0]}, r"3 finite numbers as '\[1\]'"),
        ({"rotation": "abc"}, "a list as 'rotation', found 'abc'"),
        ({"translation": [1e300, 0.0, 0.0]}, "a finite number within 1e9"),
        ({"matrix": [[500.0, 0.0, 320.0], [9.0, 500.0, 240.0], [0.0, 0.0, 1.0]]}, "fx, skew, cx"),
        ({"name": 3}, "a name of 1 to 100 characters.* as 'name', found 3"),
        ({"name": "../front"}, "without slashes, control or direction characters as 'name'"),
        ({"matrix": None, "size": None}, "expected the key 'size', found none"),
    ],
)
def test_malformed_cameras(write, changes, expected):
    with pytest.raises(CalibrationError, match=expected) as caught:
        read_calibration(write({"cam01": section(**changes)}))
    assert re.search(r"cam01|front", str(caught.value))


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ("[cam01]\nname = \nsize = [640, 480]\n", "line 2"),
        ("[cam01]\nname = ", "line 2"),
        ({}, "found none"),
        ({"metadata": {"error": 1.0}}, "found none"),
        ({"version": 3, "cam01": section()}, "lone key 'version'"),
        ({"cam01": section(), "cam02": section()}, "two cameras are named 'front'"),
    ],
)
def test_malformed_files(write, data, expected):
    with pytest.raises(CalibrationError, match=expected):
        read_calibration(write(data))


def test_missing_file(tmp_path):
    with pytest.raises(CalibrationError, match="not found"):
        read_calibration(tmp_path / "none.toml")


def test_binary_file(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_calibration(tmp_path / "a.toml")
