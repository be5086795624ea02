"""Joints in space of each program come back as they were written; others are named."""

from pathlib import Path

import numpy as np
import pytest
from joint_files import IN_CM, IN_MM, KINDS, NUMBERED, OF_PEOPLE, write_joints
from observed_people import BODY_25, walking
from program_tables import joint_table

from tracker.errors import FormatError, Remedy
from tracker.formats.c3d import read_c3d
from tracker.formats.joint_tables.layouts import LAYOUTS, NOT_READ, SCENES, by_subject, find_layout, read_joint_files
from tracker.formats.observation_layout import Sample
from tracker.geometry.arrays import DAMAGED_ARRAYS
from tracker.interchange.observations.readers import find_files

N = 6
ONE = walking(N)
ONE[2, 4] = np.nan
ONE[4] = np.nan
BOTH = np.stack([ONE, ONE + 0.5])


def people_of(kind):
    """Points of the people that a kind can hold, (n_people, N, n_points, 3), and their names."""
    points = BOTH if kind in OF_PEOPLE else BOTH[:1]
    return (points[:, :, :19], BODY_25.points[:19]) if kind == "panoptic" else (points, BODY_25.points)


def read(path, unit_m=None):
    if path.suffix == ".c3d":
        return [(path, read_c3d(path, None))]
    return read_joint_files(sorted(path.iterdir()) if path.is_dir() else [path], unit_m, 30.0)


@pytest.mark.parametrize("kind", KINDS)
def test_joints_come_back(tmp_path, kind):
    points, names = people_of(kind)
    path = write_joints(kind, tmp_path, names, points)
    found = [own for _, table in read(path, 1.0) for own in by_subject(table)]
    expected = {"nexus": "Ann", "motive": "Ann", "c3d": "Ann", "people": "ann", "individuals": "ann", "wide": ""}.get(
        kind
    )
    assert len(found) == len(points)
    for table, truth in zip(found, points, strict=True):
        is_named = kind not in NUMBERED and kind != "panoptic"
        assert table.names == (tuple(names) if is_named else tuple(map(str, range(len(names)))))
        whole = np.full(truth.shape, np.nan)
        whole[table.frames - (kind == "qtm with times")] = table.points
        assert np.array_equal(np.isnan(whole), np.isnan(truth))
        assert np.nanmax(np.abs(whole - truth)) < 1e-5
        assert table.rate == pytest.approx(30.0, rel=1e-3)
    assert expected is None or found[0].person == expected


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in (*NUMBERED[1:], "panoptic", "c3d")])
def test_each_table_is_known_by_its_content(tmp_path, kind):
    points, names = people_of(kind)
    found = find_layout(Sample(write_joints(kind, tmp_path, names, points)))
    word = {"wide": "anipose", "people": "anipose", "semicolon": "anipose", "individuals": "deeplabcut"}.get(kind, kind)
    word = {"tidy": "freemocap", "qtm": "qualisys", "qtm with times": "qualisys"}.get(word, word)
    assert word in found.program.lower()


def test_scenes_are_known_by_their_content(tmp_path):
    for kind, layout in zip(("easymocap", "panoptic"), SCENES, strict=True):
        points, names = people_of(kind)
        (first, *_) = sorted(write_joints(kind, tmp_path, names, points).iterdir())
        assert find_layout(Sample(first)) is layout
    first.write_text('[{"image_id": 1, "keypoints": [1, 2, 3]}]')
    assert find_layout(Sample(first)) is None


@pytest.mark.parametrize(
    "kind", ["semicolon", "deeplabcut", "anipose", "jarvis", "tidy", "caliscope", "easymocap", "npy"]
)
def test_files_without_a_unit_ask_for_it(tmp_path, kind):
    points, names = people_of(kind)
    with pytest.raises(FormatError, match="unit") as caught:
        read(write_joints(kind, tmp_path, names, points))
    assert caught.value.remedy == Remedy("say_unit")
    assert kind not in (*IN_MM, *IN_CM)


A_POINT = "frame,a_x_m,a_y_m,a_z_m\n"


@pytest.mark.parametrize(
    ("text", "frames", "x"),
    [
        ("frame,keypoint,x_m,y_m,z_m\n3,a,1,2,3\n0,b,1,2,3\n0,a,5,2,3\n", [0, 3], [5, 1]),
        ("frame;keypoint;x_m;y_m;z_m\n0;a;1,5;2;3\n", [0], [1.5]),
        (A_POINT + "0,1,2,3\n1,,2,3\n2,0,0,0\n3,4,2,3\n", [0, 1, 2, 3], [1, np.nan, np.nan, 4]),
        ("a_x_m,a_y_m,a_z_m\n1,2,3\n,,\n4,2,3\n\n,,\n", [0, 2], [1, 4]),
        ("sep=;\nframe;a_x_m;a_y_m;a_z_m\n0;1,5;2;3\n", [0], [1.5]),
        ("frame,a_x,a_y,a_z\n,mm,mm,mm\n0,1000,2,3\n1,2000,2,3\n", [0, 1], [1, 2]),
        ("a_x_m,a_y_m,a_z_m\n,,\n1,2,3\n", [1], [1]),
        ("timestamp,a_x_m,a_y_m,a_z_m\n2026-01-01T10:00:00.033,1,2,3\n", [0], [1]),
        ("time_s,keypoint,x_m,y_m,z_m\n0.1,a,1,2,3\n0.1,b,1,2,3\n0.2,a,4,2,3\n", [0, 1], [1, 4]),
        ("frame,model,keypoint,x_m,y_m,z_m\n0,left,a,1,2,3\n0,right,a,7,2,3\n", [0], [1]),
    ],
)
def test_sparse_tables_shift_nothing(tmp_path, text, frames, x):
    (tmp_path / "a.csv").write_text(text)
    ((_, table),) = read(tmp_path / "a.csv")
    at = table.names.index("a")
    assert table.frames.tolist() == frames
    assert np.array_equal(table.points[:, at, 0], x, equal_nan=True)


def test_qualisys_with_times_and_points_that_are_missing_at_first(tmp_path):
    (tmp_path / "a.tsv").write_text(
        "NO_OF_FRAMES\t2\nFREQUENCY\t100\nMARKER_NAMES\ta\tb\n1\t0\t\t\t\t4\t5\t6\n2\t0.01\t1\t2\t3\t4\t5\t6\n"
    )
    ((_, table),) = read(tmp_path / "a.tsv")
    assert table.frames.tolist() == [1, 2]
    assert np.array_equal(table.points[:, :, 0], [[np.nan, 0.004], [0.001, 0.004]], equal_nan=True)


def test_bones_and_markers_of_motive(tmp_path):
    columns = [("Bone", "Ann:Hip", "Rotation", a) for a in "XYZW"] + [("Bone", "Ann:Hip", "Position", a) for a in "XYZ"]
    columns += [("Marker", "Ann:Hip", "Position", a) for a in "XYZ"]
    columns += [("Marker", "Ann:Head", "Position", a) for a in "XYZ"] + [("Marker", "Ann:Head", "Marker Quality", "")]
    rows = [
        ",".join([*label, *row])
        for label, row in zip(
            (("", "Type"), ("", "Name"), ("", ""), ("Frame", "Time (Seconds)")), zip(*columns, strict=True), strict=True
        )
    ]
    rows.insert(2, ",ID" + ',"1"' * len(columns))
    rows.insert(3, ",Parent" + ',""' * len(columns))
    numbers = ",".join(str(i) for i in range(len(columns)))
    (tmp_path / "a.csv").write_text(
        "\n".join(["Format Version,1.25,Length Units,Centimeters", "", *rows, f"0,0,{numbers}"])
    )
    ((_, table),) = read(tmp_path / "a.csv")
    assert table.names == ("Ann:Hip", "Ann:Head")
    assert np.allclose(table.points, [[[0.04, 0.05, 0.06], [0.1, 0.11, 0.12]]])


def test_a_body_of_freemocap_loses_its_prefix(tmp_path):
    points = "body_nose_x,body_nose_y,body_nose_z,right_hand_wrist_x,right_hand_wrist_y,right_hand_wrist_z"
    (tmp_path / "walk_by_trajectory.csv").write_text(
        f'timestamp,timestamp_by_camera,{points}\n0.0,"{{0: 0.0, 1: 0.1}}",1,2,3,4,5,6\n0.1,"{{0: 0.1}}",1,2,3,4,5,6\n'
    )
    ((_, table),) = read(tmp_path / "walk_by_trajectory.csv", 1.0)
    assert table.names == ("nose", "right_hand_wrist")
    assert table.points[1].tolist() == [[1, 2, 3], [4, 5, 6]]


def test_panoptics_older_joints_are_named(tmp_path):
    (tmp_path / "body3DScene_00000140.json").write_text('{"bodies": [{"id": 0, "joints15": [1, 2, 3, 0.5]}]}')
    with pytest.raises(FormatError, match="expected 19 joints of CMU Panoptic, found none; take the folder"):
        read(tmp_path)


def test_a_name_of_two_groups(tmp_path):
    (tmp_path / "a.csv").write_text("frame,model,keypoint,x_m,y_m,z_m\n0,left,a,1,2,3\n0,right,a,7,2,3\n")
    ((_, table),) = read(tmp_path / "a.csv")
    assert table.names == ("a", "right.a")


@pytest.mark.parametrize(
    ("name", "values", "rate"),
    [
        ("timestamp", [1.7e9, 1.7e9 + 0.04], 25),
        ("timestamp", [1.7e12, 1.7e12 + 40], 25),
        ("timestamp", [1.7e15, 1.7e15 + 4e4], 25),
        ("time_ms", [0, 20], 50),
        ("Time (Seconds)", [0, 0.02], 50),
    ],
)
def test_times_are_seconds_milliseconds_or_of_the_day(tmp_path, name, values, rate):
    rows = "".join(f"{v:.6f},1,2,3\n" for v in values)
    (tmp_path / "a.csv").write_text(f"{name},a_x_m,a_y_m,a_z_m\n{rows}")
    ((_, table),) = read(tmp_path / "a.csv")
    assert table.rate == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time,a_x_m,a_y_m,a_z_m\n0,1,2,3\n33,1,2,3\n", "expected times in seconds, found steps of 33"),
        ("time,a_x_m,a_y_m,a_z_m\n0,1,2,3\n,1,2,3\n", "a time in each row"),
        (A_POINT + "0,1,2,3\n1,1,2,3\n0,4,5,6\n", "found 0 after 1; give each person or take a file of its own"),
        (
            "frame,keypoint,x_m,y_m,z_m\n0,a,1,2,3\n0,a,4,5,6\n",
            "line 3: expected one row of 'a' in each frame, found two",
        ),
        ("frame,keypoint,x_m,y_m,z_m\n0,,1,2,3\n", "line 2: expected the name of a point"),
        ("keypoint,x_m,y_m,z_m\na,1,2,3\n", "a column of frames"),
        ("frame;a_x_m;a_y_m;a_z_m\n0;1.5;2,5;3\n", "points or commas in decimal numbers, found both"),
        ('frame,a_x_m,a_y_m,a_z_m\n0,"1,5",2,3\n', "a point in decimal numbers, found a comma in '1,5'"),
        ("Devices\n1000\nFrame,Sub Frame,Fx\n1,0,3\n", "section Trajectories, found Devices; export the trajectories"),
        (
            "Format Version,1.23\n,,Rigid Body,Rigid Body,Rigid Body\n,,a,a,a\n,,Position,Position,Position\n"
            "Frame,Time,X,Y,Z\n0,0,1,2,3\n",
            "labelled markers or bones, found Rigid Body; export",
        ),
        ("NO_OF_FRAMES\t3\nNO_OF_BODIES\t1\nBODY_NAMES\twand\n1\t2\t3\n", "MARKER_NAMES.*Qualisys Track Manager"),
        ("scorer,a,a,a\ncoords,x,y,z\n0,1,2,3\n", "names of points above x, y and z"),
        ("frame,keypoint,x_m,y_m,z_m\n" + "".join(f"0,p{i},1,2,3\n" for i in range(2100)), "at most 2000 points"),
    ],
)
def test_messages_speak_of_the_file(tmp_path, text, expected):
    path = tmp_path / ("a.tsv" if text.startswith("NO_OF") else "a.csv")
    path.write_text(text)
    with pytest.raises(FormatError, match=expected):
        read(path, 1.0)


def test_subjects(tmp_path):
    head = ",".join(f"{name}_{axis}_m" for name in ("ann:a", "ben:a", "w:o") for axis in "xyz")
    (tmp_path / "a.csv").write_text(f"{head}\n1,2,3,4,5,6,7,8,9\n")
    ((_, table),) = read(tmp_path / "a.csv")
    ann, ben = by_subject(table)
    assert (ann.person, ann.names, ben.person, ben.points[0, 0, 0]) == ("ann", ("a",), "ben", 4)
    assert ann.notes == ("points of no person, such as w:o, are left out",)
    assert by_subject(table, ["ann:a"]) == [table]


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        (np.zeros((3, 24, 2)), "an array"),
        (np.array([{"a": 1}], dtype=object), "an array"),
        (np.zeros((3, 6890, 3)), "an array"),
        (np.zeros((3, 24, 3, 3)), "an array"),
    ],
)
def test_other_arrays_are_named(tmp_path, array, expected):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(FormatError, match=expected):
        read(tmp_path / "a.npy", 1.0)


def test_the_size_of_an_array_is_checked_before_it_is_read(tmp_path):
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (900000000, 24, 3)}".ljust(117) + "\n"
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode())
    with pytest.raises(FormatError, match="at most 40000000 values"):
        read(tmp_path / "a.npy", 1.0)
    np.savez(tmp_path / "a.npz", one=np.zeros((2, 24, 3)), other=np.zeros((2, 24, 3)))
    with pytest.raises(FormatError, match="found one, other; save"):
        read(tmp_path / "a.npz", 1.0)
    assert OSError in DAMAGED_ARRAYS


def test_files_that_are_not_read_are_named(tmp_path):
    for name, begin, expected in (
        ("a.fbx", b"", "FBX, .*; export BVH"),
        ("fits", b"\x80\x04", "Python pickle, as fits of SMPL"),
        ("a.mat", b"MATLAB 5.0", "MATLAB file, .* export a CSV"),
        ("a.tak", b"", "a project of Motive"),
    ):
        (tmp_path / name).write_bytes(begin)
        with pytest.raises(FormatError, match=expected):
            find_files([tmp_path / name])
    (tmp_path / "a.txt").write_text("words")
    for name in ("a.txt", "missing"):
        assert not any(layout.recognizes(Sample(tmp_path / name)) for layout in NOT_READ)


def test_the_table_for_documents():
    table = joint_table().splitlines()
    text = (Path(__file__).resolve().parents[4] / "docs" / "log" / "observations.md").read_text("utf-8")
    assert joint_table() in text
    assert len(table) == 2 + len(LAYOUTS) + len(NOT_READ)
    assert all(line.count("|") == 4 for line in table)
