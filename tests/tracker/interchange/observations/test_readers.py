"""Files of each format: key points and joints come back as they were written, and wrong ones are refused."""

import json

import numpy as np
import pytest
from observed_files import (
    convert_c3d,
    write_bvh_chain,
    write_c3d,
    write_coco_images,
    write_deeplabcut,
    write_points_csv,
    write_sleap,
)
from observed_people import BODY_25, make_session, seen, walking

from tracker.errors import FormatError, Remedy
from tracker.formats.bvh_reading import read_bvh
from tracker.formats.c3d import patch_c3d, read_c3d
from tracker.formats.joint_tables.layouts import read_joint_files
from tracker.formats.keypoints import hdf5
from tracker.formats.keypoints.coco_reading import read_coco
from tracker.formats.keypoints.deeplabcut import read_deeplabcut_csv
from tracker.formats.keypoints.detections import read_openpose
from tracker.formats.keypoints.hdf5 import read_hdf5_apart
from tracker.interchange.observations.importing import plan_import
from tracker.interchange.observations.observed import observed_joints
from tracker.interchange.observations.plans import ImportRequest

N = 8
TRUTH = walking(N)


def read_one(path, unit_m):
    ((_, table),) = read_joint_files([path], unit_m, 30.0)
    return table


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


def imported(session, path, **choices):
    request = ImportRequest("mp", (path,), ("ann",), **choices)
    plan = plan_import(session, request)
    assert not plan.problems, plan.problems
    return plan.observations


def in_space(session, observations):
    return observed_joints(observations, [c.camera for c in session.cameras]).joints_world[:, 0]


@pytest.mark.parametrize("kind", ["csv", "multi", pytest.param("h5", marks=pytest.mark.slow)])
def test_deeplabcut(session, tmp_path, kind):
    if kind == "h5":
        pytest.importorskip("h5py")
    points = seen(session, [TRUTH])
    for v, name in enumerate(session.camera_names):
        write_deeplabcut(tmp_path / "dlc" / f"{name}DLC_resnet50_demo", BODY_25.points, points[:, v], kind)
    observations = imported(session, tmp_path / "dlc")
    assert observations.format == ("hdf5" if kind == "h5" else "deeplabcut")
    assert np.abs(in_space(session, observations) - TRUTH).max() < 1e-4
    assert np.allclose(observations.points.confidence[observations.points.is_known], 0.9)


def test_deeplabcut_labels_of_pictures(tmp_path):
    path = tmp_path / "labels.csv"
    path.write_text(
        "scorer,,,ann,ann\nbodyparts,,,nose,nose\ncoords,,,x,y\n"
        "labeled-data,cam0,img0003.png,1.5,2.5\nlabeled-data,cam0,img0010.png,,\n"
    )
    table = read_deeplabcut_csv(path)
    assert table.numbers.tolist() == [3, 10]
    assert table.points[0, 0, 0, :2].tolist() == [1.5, 2.5]
    assert not table.has_confidence
    assert not table.is_found[1].any()


MALFORMED = {
    "deeplabcut": [
        ("scorer,a,a\nbodyparts,n,n\n0,1,2\n", "the rows scorer, bodyparts and coords of equal length"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,z\n0,1,2\n", "each x, y and likelihood once, found 'z'"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\n0,1\n", "line 4: expected 3 columns, found 2"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\nzero,1,2\n", "the number of a picture"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\n0,1,two\n", "expected numbers, found 'two'"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\n", "no rows of numbers"),
    ],
    "coco": [
        ('{"images": [], "annotations": []}', "annotations with key points, found none"),
        (
            '[{"image_id": 1, "keypoints": [1, 2, 3]}, {"image_id": 2, "keypoints": [1, 2]}]',
            "3 numbers for 1 key points",
        ),
        ('{"images": [{"id": -1}], "annotations": []}', "a whole number"),
    ],
    "openpose": [
        ('{"people": [{"pose_keypoints_2d": [1, 2]}]}', "x, y and confidence of each point.*found 2 numbers"),
        ('{"version": 1.3}', "expected the key 'people', found version"),
        ('{"people": [{"pose_keypoints_2d": [1e99, 2, 1]}]}', "a finite number"),
        ("{", "not valid JSON"),
        ("[]", "expected"),
    ],
    "csv": [
        ("frame,a_x,a_y\n0,1,2\n", "'a' without all three"),
        ("frame,a_x,a_y,a_z\n0,1,2\n", "line 2: expected 4 columns, found 3"),
        ("frame,a_x,a_y,a_z,a_x\n", "each column once, found 'a_x' twice"),
        ("frame,a_x_m,a_y_m,a_z_mm\n", "in one unit"),
        ("frame,b,c\n", "columns NAME_x, NAME_y, NAME_z"),
        ("", "columns NAME_x, NAME_y, NAME_z"),
    ],
}
"""For each format, files that are not of it and what the message says."""
READERS = {
    "deeplabcut": ("a.csv", read_deeplabcut_csv),
    "coco": ("c.json", read_coco),
    "openpose": ("a_1.json", read_openpose),
    "csv": ("a.csv", lambda path: read_one(path, 1.0)),
}


@pytest.mark.parametrize(
    ("kind", "text", "expected"), [(kind, *row) for kind, rows in MALFORMED.items() for row in rows]
)
def test_malformed(tmp_path, kind, text, expected):
    name, read = READERS[kind]
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError, match=expected):
        read(tmp_path / name)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".slp", ".h5", ".nwb"])
def test_sleap_and_nwb(session, tmp_path, suffix):
    pytest.importorskip("sleap_io")
    points = seen(session, [TRUTH])
    for v, name in enumerate(session.camera_names):
        write_sleap(tmp_path / "sleap" / f"{name}{suffix}", BODY_25.points, points[:, v])
    observations = imported(session, tmp_path / "sleap")
    assert observations.format == "hdf5"
    assert np.abs(in_space(session, observations) - TRUTH).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("step", [1.0, 1 / 30])
def test_pictures_without_a_point_shift_no_others_in_nwb(tmp_path, step):
    """sleap-io numbers the pictures by their order, and times may be rounded to milliseconds."""
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("sleap_io")
    points = np.full((7, 1, 3, 3), 50.0)
    points[[1, 2, 5]] = np.nan
    write_sleap(tmp_path / "a.nwb", ("hip", "knee", "ankle"), points)
    with h5py.File(tmp_path / "a.nwb", "r+") as file:
        found = []
        file.visititems(lambda name, item: found.append(item) if name.endswith("/timestamps") else None)
        for times in found:
            times[:] = np.round(times[:] * step, 3)
    ((_, table),) = read_hdf5_apart(tmp_path / "a.nwb")
    assert table.names == ("hip", "knee", "ankle")
    assert table.numbers.tolist() == [0, 3, 4, 6]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.slp", "a.h5", "a.nwb"])
def test_damaged_hdf5(tmp_path, name):
    pytest.importorskip("sleap_io")
    (tmp_path / name).write_bytes(b"nothing")
    with pytest.raises(FormatError, match=r"cannot be read: .*; export it again"):
        read_hdf5_apart(tmp_path / name)


@pytest.mark.slow
def test_a_missing_package_is_one_sentence(tmp_path, monkeypatch):
    """A module that raises on import stands for one that is not there."""
    for package in ("sleap_io", "h5py"):
        (tmp_path / f"{package}.py").write_text(f"raise ModuleNotFoundError('no', name='{package}')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    for name, needed in (("a.slp", "h5py"), ("a.h5", "h5py")):
        (tmp_path / name).write_bytes(b"x")
        with pytest.raises(FormatError, match=f"needs the package {needed}, which is not installed") as caught:
            read_hdf5_apart(tmp_path / name)
        assert caught.value.remedy == Remedy("install_extra", extra="import")


@pytest.mark.slow
def test_a_library_that_hangs_or_dies(tmp_path, monkeypatch):
    (tmp_path / "a.slp").write_bytes(b"x")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "h5py.py").write_text("import os; os._exit(11)")
    with pytest.raises(FormatError, match="its library failed; export it again"):
        read_hdf5_apart(tmp_path / "a.slp")
    (tmp_path / "h5py.py").write_text("import time; time.sleep(60)")
    monkeypatch.setattr(hdf5, "LIMITS", hdf5.LIMITS._replace(seconds=1.0))
    with pytest.raises(FormatError, match="it took over 1 s, as damaged files do"):
        read_hdf5_apart(tmp_path / "a.slp")


@pytest.mark.parametrize("of", ["folders", "cameras", "scores"])
def test_coco(session, tmp_path, of):
    points = seen(session, [TRUTH])
    write_coco_images(tmp_path / "coco.json", session.camera_names, BODY_25.points, points, of)
    observations = imported(session, tmp_path / "coco.json", confidence=1.0 if of == "folders" else None)
    assert observations.format == "coco"
    assert np.abs(in_space(session, observations) - TRUTH).max() < 1e-4


def test_coco_flags_are_no_confidence(session, tmp_path):
    write_coco_images(tmp_path / "coco.json", session.camera_names, BODY_25.points, seen(session, [TRUTH]), "folders")
    plan = plan_import(session, ImportRequest("mp", (tmp_path / "coco.json",), ("ann",)))
    assert "expected a confidence for each point, found none" in str(plan.problems[0])


def test_people_without_a_score_among_others_are_certain(session, tmp_path):
    path = tmp_path / "coco.json"
    write_coco_images(path, session.camera_names, BODY_25.points, seen(session, [TRUTH]), "cameras")
    data = json.loads(path.read_text())
    del data["annotations"][2]["score"]  # corrected by hand
    path.write_text(json.dumps(data))
    observations = imported(session, path)
    assert sorted(set(observations.points.confidence[observations.points.is_known].round(6))) == [0.7, 1.0]
    assert any("25 points without a confidence" in note for note in observations.notes)


def test_coco_of_another_size(session, tmp_path):
    write_coco_images(tmp_path / "c.json", session.camera_names, BODY_25.points, seen(session, [TRUTH]), "scores")
    data = json.loads((tmp_path / "c.json").read_text())
    for image in data["images"]:
        image["width"], image["height"] = 1280, 960
    (tmp_path / "c.json").write_text(json.dumps(data))
    plan = plan_import(session, ImportRequest("mp", (tmp_path / "c.json",), ("ann",)))
    assert "key points of the 640x480 footage, found 1280x960 in the file" in str(plan.problems[0])


def test_c3d(session, tmp_path):
    pytest.importorskip("ezc3d")
    points = TRUTH.copy()
    points[2, 5] = np.nan
    write_c3d(tmp_path / "a.c3d", BODY_25.points, points, 30.0)
    observations = imported(session, tmp_path / "a.c3d")
    there = observations.joints.joints_world[:, 0]
    assert np.isnan(there[2, 5]).all()
    assert np.nanmax(np.abs(there - points)) < 1e-6
    table = read_c3d(tmp_path / "a.c3d", None)
    assert (table.names, table.rate, table.frames[0]) == (BODY_25.points, 30.0, 0)


def test_bvh(session, tmp_path):
    write_bvh_chain(tmp_path / "a.bvh")
    table = read_bvh(tmp_path / "a.bvh", 0.01)
    assert table.names == ("Hips", "LeftUpLeg", "LeftLeg", "LeftLeg_end")
    # The root turns by 90 degrees about z: x becomes y. The knee bends by 90 degrees about x: -y becomes -z.
    expected = [[0.1, 0.2, 0.3], [0.1, 0.3, 0.3], [0.5, 0.3, 0.3], [0.5, 0.3, -0.1]]
    assert np.allclose(table.points[0], expected)
    assert table.rate == pytest.approx(30, rel=1e-4)
    with pytest.raises(FormatError, match="which BVH never states") as caught:
        read_bvh(tmp_path / "a.bvh", None)
    assert caught.value.remedy == Remedy("say_unit")


def test_our_own_bvh_comes_back(tmp_path):
    from tracker.formats.bvh import UPRIGHT_Y, BvhFrame, write_bvh
    from tracker.formats.model_toml import load_model

    model = load_model("gavrila38", 1.7)
    rng = np.random.default_rng(0)
    poses = np.stack([model.neutral() + 0.2 * rng.normal(size=model.neutral().shape) for _ in range(3)])
    write_bvh(tmp_path / "a.bvh", model, poses, 25.0, BvhFrame(np.eye(4), UPRIGHT_Y, 1000.0))
    table = read_bvh(tmp_path / "a.bvh", 0.001)
    for frame, pose in enumerate(poses):
        truth = dict(zip(model.point_names, model.points_world(pose), strict=True))
        for joint in ("left_elbow", "right_knee", "left_ankle"):
            assert np.linalg.norm(table.points[frame, table.names.index(joint)] - truth[joint]) < 1e-4


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("CHANNELS 3 Zrotation", "CHANNELS 2 Zrotation"), "line 9: expected the number of channels"),
        (("OFFSET 0 -40 0\n\t\t\tCH", "OFFSET 0 -40\n\t\t\tCH"), "line 12: expected OFFSET with three numbers"),
        (("Frames: 2", "Frames: 3"), "expected 3 frames, found 2"),
        (("Frame Time: 0.0333333", "Frame Time: 0"), "a time above 0 s"),
        (("MOTION", "MOTON"), "a joint of the hierarchy, found 'MOTON'"),
        (("JOINT LeftLeg", "JOINT LeftUpLeg"), "'LeftUpLeg' twice"),
    ],
)
def test_malformed_bvh(tmp_path, change, expected):
    write_bvh_chain(tmp_path / "a.bvh")
    text = (tmp_path / "a.bvh").read_text()
    assert change[0] in text
    (tmp_path / "a.bvh").write_text(text.replace(*change))
    with pytest.raises(FormatError, match=expected):
        read_bvh(tmp_path / "a.bvh", 0.01)


@pytest.mark.parametrize("unit", ["", "mm"])
def test_csv_of_points(session, tmp_path, unit):
    points = TRUTH.copy()
    points[3, 4] = np.nan
    write_points_csv(tmp_path / "a.csv", BODY_25.points, points, 30.0, unit)
    observations = imported(session, tmp_path / "a.csv", unit_m=None if unit else 1.0)
    assert observations.format == "csv"
    assert np.nanmax(np.abs(observations.joints.joints_world[:, 0] - points)) < 1e-6
    assert np.isnan(observations.joints.joints_world[3, 0, 4]).all()


def test_a_csv_with_the_index_of_its_table_and_a_column_of_frames(tmp_path):
    lines = [",frame,left_wrist_x_m,left_wrist_y_m,left_wrist_z_m", "0,100,1,2,3", "1,103,1,2,3"]
    (tmp_path / "p.csv").write_text("\n".join(lines))
    assert read_one(tmp_path / "p.csv", None).frames.tolist() == [100, 103]
    (tmp_path / "p.csv").write_text("\n".join(lines).replace("frame", "error"))
    assert read_one(tmp_path / "p.csv", None).frames.tolist() == [0, 1]


def test_a_csv_without_a_unit(tmp_path):
    write_points_csv(tmp_path / "a.csv", BODY_25.points, TRUTH, 30.0, "")
    with pytest.raises(FormatError, match="a unit in the names, found none") as caught:
        read_one(tmp_path / "a.csv", None)
    assert caught.value.remedy == Remedy("say_unit")


def test_several_formats_and_none(session, tmp_path):
    write_points_csv(tmp_path / "f" / "a.csv", BODY_25.points, TRUTH, 30.0, "m")
    (tmp_path / "f" / "b.trc").write_text("PathFileType")
    with pytest.raises(FormatError, match=r"files of one format, found a\.csv \(CSV\) and b\.trc \(TRC\)"):
        imported(session, tmp_path / "f")
    with pytest.raises(FormatError, match=r"found none at .*nothing; check the path"):
        imported(session, tmp_path / "nothing")
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError, match=r"files that end in .*, found none in"):
        imported(session, tmp_path / "empty")


@pytest.mark.parametrize("kind", ["integers", "big-endian", "dec"])
def test_c3d_of_other_computers(tmp_path, kind):
    pytest.importorskip("ezc3d")
    write_c3d(tmp_path / "a.c3d", BODY_25.points, TRUTH, 30.0)
    convert_c3d(tmp_path / "a.c3d", kind)
    table = read_c3d(tmp_path / "a.c3d", None)
    assert table.names == BODY_25.points
    assert table.rate == 30.0
    assert np.abs(table.points - TRUTH).max() < (1e-4 if kind == "integers" else 1e-6)
    moved = {2: TRUTH[2] + 0.1}
    if kind == "dec":
        with pytest.raises(FormatError, match="found DEC's"):
            patch_c3d(tmp_path / "a.c3d", None, moved)
        return
    (tmp_path / "b.c3d").write_bytes(patch_c3d(tmp_path / "a.c3d", None, moved))
    again = read_c3d(tmp_path / "b.c3d", None).points
    assert np.abs(again[2] - moved[2]).max() < 1e-4
    assert np.array_equal(np.delete(again, 2, axis=0), np.delete(table.points, 2, axis=0))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda d: d[:300], "is not a C3D file"),
        (lambda d: d[:2] + b"\xff\x7f" + d[4:], "expected 1 to 2000 points"),
        (lambda d: b"\x09" + d[1:], "the section of parameters"),
        (lambda d: d[:20] + b"\0\0\0\0" + d[24:], "a frame rate above 0"),
        (lambda d: d.replace(b"LABELS", b"LABELX"), "a name for each of 25 points"),
        (lambda d: d.replace(b"\x02mm", b"\x02zz"), "POINT:UNITS to be mm or m, found 'zz'"),
        (lambda d: d[: len(d) - 9 * 25 * 16], "frames of points, found none|it has"),
    ],
)
def test_malformed_c3d(tmp_path, change, expected):
    pytest.importorskip("ezc3d")
    write_c3d(tmp_path / "a.c3d", BODY_25.points, TRUTH, 30.0)
    (tmp_path / "a.c3d").write_bytes(change((tmp_path / "a.c3d").read_bytes()))
    with pytest.raises(FormatError, match=expected):
        read_c3d(tmp_path / "a.c3d", None)


def test_a_c3d_with_more_frames_than_its_header_can_say(tmp_path):
    pytest.importorskip("ezc3d")
    path = tmp_path / "p.c3d"
    write_c3d(path, BODY_25.points, TRUTH, 30.0)
    data = bytearray(path.read_bytes())
    data[8:10] = (5).to_bytes(2, "little")
    path.write_bytes(data)
    found = read_c3d(path, None)
    assert (len(found.frames), found.notes) == (5, (f"its header promises 5 frames, it has {len(TRUTH)}",))


def test_a_c3d_that_was_cut_off(tmp_path):
    pytest.importorskip("ezc3d")
    write_c3d(tmp_path / "a.c3d", BODY_25.points, TRUTH, 30.0)
    data = (tmp_path / "a.c3d").read_bytes()
    start = 512 * (int.from_bytes(data[16:18], "little") - 1)
    (tmp_path / "a.c3d").write_bytes(data[: start + 3 * 25 * 16 + 7])
    table = read_c3d(tmp_path / "a.c3d", None)
    assert len(table.points) == 3
    assert table.notes == ("its header promises 8 frames, it has 3",)
