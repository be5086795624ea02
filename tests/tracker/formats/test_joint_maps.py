import re
from pathlib import Path

import numpy as np
import pytest

from app.remedies import command_line_text
from tracker.errors import FormatError, Remedy
from tracker.formats.joint_maps import JOINTS, LIMB_JOINTS, guess_joint_map, joints_of, read_joint_map
from tracker.formats.model_toml import PRESETS, load_model
from tracker.formats.trc import MarkerTable, read_trc

COCO = ["nose", "left_eye", "right_eye", "left_ear", "right_ear"] + [
    f"{s}_{j}" for j in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for s in ("left", "right")
]


def table(names):
    """One row, in which each point stands at x = its column."""
    points = np.zeros((1, len(names), 3))
    points[0, :, 0] = np.arange(len(names))
    return MarkerTable(tuple(names), np.array([0]), np.array([0.0]), points, 30.0)


@pytest.mark.parametrize("preset", PRESETS)
def test_our_names_are_the_models(preset):
    assert set(JOINTS) <= set(load_model(preset).point_names)


@pytest.mark.parametrize(
    ("file", "name"), [("walk/ground_truth.trc", "CMU"), ("balance_real/reference_joints.trc", "BODY_25")]
)
def test_conventions_of_the_footage_at_hand(data_folder, file, name):
    folder, trc = file.split("/")
    markers = read_trc(data_folder(folder) / trc)
    assert guess_joint_map(markers.names, trc).name == name
    joints = joints_of(markers, trc)
    assert joints.names == JOINTS
    first = dict(zip(joints.names, joints.points[0], strict=True))
    # Z is up: a standing man's joints follow each other from head to foot, and his left is on one side.
    for side in ("left", "right"):
        heights = [first[f"{side}_{j}"][2] for j in ("shoulder", "hip", "knee", "ankle")]
        assert heights == sorted(heights, reverse=True)
        assert np.linalg.norm(first[f"{side}_shoulder"] - first[f"{side}_elbow"]) < 0.4
    across = first["left_hip"] - first["right_hip"]
    assert np.dot(across, first["left_shoulder"] - first["right_shoulder"]) > 0


def test_cmu_names_a_joint_after_the_bone_that_begins_there():
    names = ["LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftUpLeg", "LeftLeg", "LeftFoot"]
    joints = joints_of(table(names), "x.trc")
    assert joints.names == LIMB_JOINTS[:6]
    assert joints.points[0, :, 0].tolist() == [1, 2, 3, 4, 5, 6]  # LeftShoulder is the collar bone


def test_coco_and_our_own_names():
    joints = joints_of(table(COCO), "x.trc")
    assert joints.names == LIMB_JOINTS  # COCO has neither neck nor head
    assert joints.points[0, 0, 0] == COCO.index("left_shoulder")


def test_markers_that_a_file_lacks_are_left_out():
    joints = joints_of(table(["LHip", "LKnee", "RHip", "RKnee", "Neck"]), "x.trc")
    assert joints.names == ("left_hip", "left_knee", "right_hip", "right_knee", "neck")


def test_unknown_convention():
    with pytest.raises(FormatError, match=r"x\.trc follow no known convention.*found LASI, RASI") as caught:
        guess_joint_map(["LASI", "RASI", "LHip"], "x.trc")
    assert caught.value.remedy == Remedy("give_joint_map", marker='"LASI"')


def test_joint_map_file(tmp_path):
    (tmp_path / "map.toml").write_text('left_hip = "LHJC"\nhead = "C7"\n')
    joints = joints_of(table(["C7", "x", "LHJC"]), "x.trc", read_joint_map(tmp_path / "map.toml"))
    assert joints.names == ("left_hip", "head")
    assert joints.points[0, :, 0].tolist() == [2, 0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('left_foot = "A"', "found 'left_foot'"),
        ("", "found none"),
        ("left_hip = 3", "a name .* as 'left_hip', found 3"),
        ("left_hip =", "line 1"),
    ],
)
def test_malformed_joint_map(tmp_path, text, expected):
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(FormatError, match=expected):
        read_joint_map(tmp_path / "map.toml")


def test_joint_map_names_a_missing_marker(tmp_path):
    (tmp_path / "map.toml").write_text('left_hip = "LHJC"')
    with pytest.raises(FormatError, match=r"no marker 'LHJC'.*expected one of A, B"):
        joints_of(table(["A", "B"]), "x.trc", read_joint_map(tmp_path / "map.toml"))


def test_the_documented_joint_map(tmp_path):
    """The example of the documents names every joint."""
    page = Path(__file__).resolve().parents[3] / "docs" / "recordings.md"
    lines = [line.strip() for line in page.read_text("utf-8").splitlines() if re.match(r' {4}\w+ = "', line)]
    (tmp_path / "map.toml").write_text("\n".join(lines))
    assert set(read_joint_map(tmp_path / "map.toml").markers) == set(JOINTS)


def test_unknown_names_are_answered_with_an_example_of_a_map():
    with pytest.raises(FormatError) as caught:
        guess_joint_map(["C7", "LSHO"], "x.trc")
    assert 'a line such as left_shoulder = "C7" for each joint' in command_line_text(caught.value)
