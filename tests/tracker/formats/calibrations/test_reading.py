"""Calibrations of many programs: the same cameras from each layout, and names for what is not read."""

import calibration_files
import numpy as np
import pytest
import tomli_w
from calibration_files import to_json, to_storage

from tracker.errors import CalibrationError
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.formats.calibrations.reading import read_cameras
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

K = np.array([[500.0, 0.0, 330.0], [0.0, 510.0, 235.0], [0.0, 0.0, 1.0]])
DIST = np.array([-0.3, 0.1, 0.001, 0.002, 0.01])


def looking(angle):
    """A camera 4 m from the origin that looks at it."""
    center = 4 * np.array([np.cos(angle), np.sin(angle), 0.3])
    z = -center / np.linalg.norm(center)
    x = np.cross([0.0, 0.0, -1.0], z)
    x /= np.linalg.norm(x)
    return rigid.transform(np.stack([x, np.cross(z, x), z], axis=1), center)


CAMERAS = [Camera(f"cam{i}", (640, 480), K + 3 * i * (K > 99), DIST * (1 + i), looking(1.3 * i)) for i in range(3)]


def opencv_rows(c):
    """Key and value of one camera with OpenCV's words."""
    R, t = c.T_camera_world[:3, :3], c.T_camera_world[:3, 3]
    return {"K": c.K, "dist": c.distortion, "R": R, "rvec": rigid.so3_log(R), "t": t, "size": list(c.size)}


def easymocap(folder, suffix="yml"):
    """Intrinsics and poses in two files; the size is not stated."""
    columns = {c.name: opencv_rows(c) for c in CAMERAS}
    intri = {"names": list(columns)} | {f"K_{n}": r["K"] for n, r in columns.items()}
    intri |= {f"dist_{n}": r["dist"][None] for n, r in columns.items()}
    extri = {"names": list(columns)} | {f"R_{n}": r["rvec"][:, None] for n, r in columns.items()}
    extri |= {f"Rot_{n}": r["R"] for n, r in columns.items()} | {f"T_{n}": r["t"][:, None] for n, r in columns.items()}
    to_storage(folder / f"intri.{suffix}", intri)
    return to_storage(folder / f"extri.{suffix}", extri)


def opencv(suffix):
    """One group for each camera, written by OpenCV."""

    def make(folder):
        names = {"K": "camera_matrix", "dist": "distortion_coefficients", "rvec": "rvec", "t": "tvec"}
        groups = {
            c.name: {names[k]: v for k, v in opencv_rows(c).items() if k in names} | {"width": 640, "height": 480}
            for c in CAMERAS
        }
        return to_storage(folder / f"cameras.{suffix}", groups)

    return make


def panoptic(folder):
    return calibration_files.panoptic(folder, CAMERAS)


def kalibr(folder):
    """A chain of cameras; the first one defines the world."""
    return calibration_files.kalibr(folder, CAMERAS)


def rows_json(folder):
    rows = [{"camera_name": c.name, **opencv_rows(c)} for c in CAMERAS]
    return to_json(folder / "rows.json", [{k: v for k, v in r.items() if k != "rvec"} for r in rows])


def halves_json(folder):
    """Intrinsics and poses apart within each camera, the poses as 3x4 matrices, 14 coefficients of distortion."""
    cameras = {
        c.name: {"intrinsics": {"K": c.K, "dist_coeffs": [*c.distortion, *[0.0] * 9], "image_size": {"width": 640,
        "height": 480}}, "extrinsics": {"RT": c.T_camera_world[:3]}} for c in CAMERAS
    }  # fmt: skip
    return to_json(folder / "halves.json", {"cameras": cameras})


def flat_json(folder):
    """Numbers apart."""
    rows = {
        c.name: {"fx": c.K[0, 0], "fy": c.K[1, 1], "cx": c.K[0, 2], "cy": c.K[1, 2], "w": 640, "h": 480,
                 "k1": c.distortion[0], "k2": c.distortion[1], "p1": c.distortion[2], "p2": c.distortion[3],
                 "k3": c.distortion[4], "rvec": opencv_rows(c)["rvec"], "tvec": opencv_rows(c)["t"]}
        for c in CAMERAS
    }  # fmt: skip
    return to_json(folder / "flat.json", rows)


def anipose(folder):
    write_calibration(folder / "Calib.toml", CAMERAS)
    return folder / "Calib.toml"


@pytest.mark.parametrize(
    "make",
    [
        anipose,
        easymocap,
        opencv("yml"),
        opencv("xml"),
        opencv("json"),
        panoptic,
        kalibr,
        rows_json,
        halves_json,
        flat_json,
    ],
    ids=lambda make: getattr(make, "__name__", "opencv"),
)
def test_the_same_cameras_from_every_layout(tmp_path, make):
    path = make(tmp_path)
    entries = read_cameras(path).entries
    assert [e.name for e in entries] == [c.name for c in CAMERAS]
    origin = CAMERAS[0].T_camera_world if make is kalibr else np.eye(4)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 3))
    for entry, expected in zip(entries, CAMERAS, strict=True):
        camera = entry.camera((640, 480))
        distortion = expected.distortion[:4] if make is kalibr else expected.distortion
        np.testing.assert_allclose(camera.distortion, distortion)
        reference = Camera("", (640, 480), expected.K, distortion, expected.T_world_camera)
        np.testing.assert_allclose(camera.project(rigid.apply(origin, points)), reference.project(points), atol=1e-6)
    if make not in (easymocap,):
        assert [e.size for e in entries] == [(640, 480)] * 3


def test_size_from_the_footage_if_it_is_plausible(tmp_path):
    (entry, *_) = read_cameras(easymocap(tmp_path)).entries
    assert entry.size is None
    assert entry.camera((660, 470)).size == (660, 470)
    with pytest.raises(
        CalibrationError, match=r"'cam0': .*no image size.*330, 235 is not that of footage of 1920x1080"
    ):
        entry.camera((1920, 1080))
    with pytest.raises(CalibrationError, match="the key 'size'"):
        entry.camera()


def test_units(tmp_path):
    assert np.linalg.norm(read_cameras(panoptic(tmp_path)).entries[0].T_world_camera[:3, 3]) == pytest.approx(
        4.176, abs=1e-3
    )
    path = rows_json(tmp_path)
    with pytest.raises(CalibrationError, match=r"found 4.18 centimetres, so that the unit is another"):
        read_cameras(path, "cm")
    with pytest.raises(CalibrationError, match=r"found 4.18 millimetres"):
        read_cameras(path, "mm")


def test_caliscope(data_folder):
    entries = read_cameras(data_folder("board_real") / "camera_array.toml").entries
    assert [e.name for e in entries] == ["cam_0", "cam_1", "cam_2", "cam_3"]
    assert all(e.size == (1280, 720) and len(e.distortion) == 5 for e in entries)
    older = read_cameras(data_folder("board_real") / "config.toml").entries
    assert [e.name for e in older] == [e.name for e in entries]
    np.testing.assert_array_equal([e.T_world_camera for e in older], [e.T_world_camera for e in entries])


def test_ignored_cameras_of_caliscope(tmp_path):
    write_calibration(tmp_path / "c.toml", CAMERAS)
    rows = read_calibration(tmp_path / "c.toml")
    sections = {
        str(i): {"cam_id": i, "ignore": i == 1, "size": c.size, "matrix": c.K.tolist(),
                 "rotation": c.T_camera_world[:3, :3].tolist(), "translation": c.T_camera_world[:3, 3].tolist()}
        for i, c in enumerate(rows)
    }  # fmt: skip
    (tmp_path / "camera_array.toml").write_text(tomli_w.dumps({"cameras": sections}))
    assert [e.name for e in read_cameras(tmp_path / "camera_array.toml").entries] == ["cam_0", "cam_2"]


def inverted(folder):
    rows = {
        c.name: {"K": c.K, "R": c.T_world_camera[:3, :3], "t": c.T_world_camera[:3, 3], "size": c.size} for c in CAMERAS
    }
    return to_json(folder / "inverted.json", rows)


def fisheye(folder):
    rows = {c.name: opencv_rows(c) | {"fisheye": True} for c in CAMERAS}
    return to_json(folder / "fisheye.json", rows)


def text(name, content):
    def make(folder):
        (folder / name).write_text(content)
        return folder / name

    return make


QUALISYS = (
    '<calibration created="2023"><cameras><camera active="1" serial="24821"><fov_video left="0"/>'
    '<transform x="1" r11="1"/><intrinsic focalLengthU="1"/></camera></cameras></calibration>'
)
XCP = '<?xml version="1.0"?><Cameras><Camera DEVICEID="1"><KeyFrames><KeyFrame/></KeyFrames></Camera></Cameras>'
LENS = "%YAML:1.0\n---\nimage_width: 640\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: "
BOMB = "a: &a [1, 2]\nb: &b [*a, *a]\nc: [*b, *b]\n"
ENTITIES = '<!DOCTYPE x [<!ENTITY a "aaaa">' + "".join(
    f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 20}">' for i in range(8)
) + "]><opencv_storage><x>&i;</x></opencv_storage>"  # fmt: skip


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (text("a.qca.txt", QUALISYS), "'24821': expected 1 numbers as left|'24821'"),
        (text("a.xcp", XCP), "'1': expected its matrix"),
        (text("a.xml", "<document><chunk/></document>"), "Metashape"),
        (text("a.xml", "<scene/>"), "XML with <scene>"),
        (text("a.pickle", "x"), "OpenCap"),
        (text("a.mat", "x"), "MATLAB.*JSON"),
        (text("t.json", '{"frames": [{"transform_matrix": []}]}'), "NeRF"),
        (text("stereo.yml", "M1: 1\nD1: 1\nM2: 1\nD2: 1\n"), "stereo"),
        (text("lens.yml", LENS + "[ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]\n"), "the lens alone"),
        (text("a.json", "{}"), "found no camera"),
        (text("a.json", "[1, 2"), "not valid JSON"),
        (text("a.json", "[" * 100000), "not valid JSON"),
        (text("a.yml", "a: [1, 2"), "not valid YAML.*line"),
        (text("a.yml", "- just\n- words\n"), "found no camera"),
        (text("a.yml", BOMB), "plain data, found references"),
        (text("a.yml", "a: " + "[" * 5000), "deep nesting|not valid YAML"),
        (text("a.xml", "<a><b></a>"), "not valid XML"),
        (text("a.xml", ENTITIES), "not valid XML"),
        (text("a.xml", ""), "an empty file"),
        (text("a.toml", ""), "an empty file"),
        (text("a.toml", "[metadata]\nerror = 1.0\n"), "found no camera"),
        (text("points.csv", "frame,x,y\n1,2,3\n"), "found another kind of file"),
        (text("camera_without_suffix", "[cam]\nname = 1\n"), "'cam'"),
        (text("a.json", '{"a": {"K": "no matrix", "R": [1, 2], "t": 3}}'), "'a': expected a list as 'rotation'|'a'"),
        (text("a.json", '{"a": {"K": [[1e999]], "R": 1, "t": 3}}'), "not valid JSON|'a'"),
        (inverted, "see no one place, found that they do if X_world = R X_camera"),
        (fisheye, "expected 0 or 4 fisheye values"),
        (lambda folder: folder, "found a folder without one"),
        (lambda folder: folder / "none.json", "none.json not found"),
    ],
)
def test_unread_files_are_named(tmp_path, make, expected):
    with pytest.raises(CalibrationError, match=f"(?s){expected}"):
        read_cameras(make(tmp_path))


@pytest.mark.parametrize("recording", ["walk", "balance_real", "fast_arms", "two_people"])
def test_real_calibrations_are_read_without_a_doubt(data_folder, recording):
    cameras = read_cameras(data_folder(recording) / "Calib.toml")
    assert len(cameras.entries) == 4
    assert cameras.notes == ()


def test_text_of_other_encodings(tmp_path):
    """A mark tells UTF-16; of Latin-1, comments and paths are read, and no name is guessed."""
    path = tmp_path / "a.toml"
    write_calibration(path, CAMERAS)
    plain = path.read_text() + "path = 'C:/Büro'  # José\n"  # of the last section, metadata
    for encoding in ("utf-16", "latin-1"):
        path.write_bytes(plain.encode(encoding))
        assert [c.name for c in read_calibration(path)] == ["cam0", "cam1", "cam2"]
    path.write_bytes(plain.replace('name = "cam1"', 'name = "Büro"').encode("latin-1"))
    with pytest.raises(CalibrationError, match=r"UTF-8 text in names, found .B.ro. as .name."):
        read_calibration(path)
