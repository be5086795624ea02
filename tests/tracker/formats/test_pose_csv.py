import numpy as np
import pytest

from tracker.errors import FormatError
from tracker.formats.model_toml import load_model, parse_model
from tracker.formats.pose_csv import read_pose_table, write_pose_table

BALL = """
version = 1
name = "ball"
joints = [
    { name = "root", child = "trunk", free = true, kind = "ball" },
    { name = "hinge", parent = "trunk", child = "arm", axes = [{ name = "bend", axis = [0, 1, 0] }] },
]
parts = [{ name = "trunk", half_axes = [0.1, 0.1, 0.1] }, { name = "arm", half_axes = [0.1, 0.1, 0.1] }]
"""


def models():
    return [load_model("gavrila22", 1.62), parse_model(BALL, "ball")]


@pytest.mark.parametrize("model", models(), ids=lambda m: m.name)
def test_round_trip(tmp_path, model):
    values = np.random.default_rng(3).normal(0, 2, (4, len(model.value_names)))
    write_pose_table(tmp_path / "a.csv", model, values, frames=[0, 1, 5, 9])
    table = read_pose_table(tmp_path / "a.csv")
    assert (table.model, table.height_m) == (model.name, model.height_m)
    assert table.frames.tolist() == [0, 1, 5, 9]
    np.testing.assert_allclose(table.values_for(model), values, atol=1e-8)


def test_people_can_read_it(tmp_path):
    model = load_model("gavrila22")
    values = np.zeros((1, 22))
    values[0, model.value_names.index("torso.x")] = 1.25
    values[0, model.value_names.index("left_elbow.extension")] = np.pi / 2
    write_pose_table(tmp_path / "a.csv", model, values)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[:3] == ["# quadrille poses, version 1", "# model = gavrila22", "# height_m = 1.75"]
    row = dict(zip(lines[3].split(","), lines[4].split(","), strict=True))
    assert row["frame"] == "0"
    assert float(row["torso.x_m"]) == 1.25
    assert float(row["left_elbow.extension_deg"]) == 90


def test_text_of_other_encodings(tmp_path):
    write_pose_table(tmp_path / "a.csv", load_model("gavrila22"), np.zeros((1, 22)))
    text = (tmp_path / "a.csv").read_text()
    (tmp_path / "a.csv").write_bytes(text.encode("utf-16"))
    assert read_pose_table(tmp_path / "a.csv").model == "gavrila22"
    with_path = text.replace("# height_m", "# path = C:\\Büro\n# height_m")
    (tmp_path / "a.csv").write_bytes(with_path.encode("latin-1"))
    assert read_pose_table(tmp_path / "a.csv").model == "gavrila22"
    for old, new in (("gavrila22", "größe"), ("torso.x", "tørso.x")):
        (tmp_path / "a.csv").write_bytes(text.replace(old, new).encode("latin-1"))
        with pytest.raises(FormatError, match=r"a\.csv.*expected UTF-8 text in names"):
            read_pose_table(tmp_path / "a.csv")


def test_quaternions_have_no_unit(tmp_path):
    model = parse_model(BALL, "ball")
    write_pose_table(tmp_path / "a.csv", model, model.neutral()[None])
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[3] == "frame,root.x_m,root.y_m,root.z_m,root.qw,root.qx,root.qy,root.qz,hinge.bend_deg"
    assert lines[4].split(",")[4] == "1.000000000"


def test_columns_may_stand_in_any_order(tmp_path):
    model = parse_model(BALL, "ball")
    path = tmp_path / "a.csv"
    path.write_text(
        "# quadrille poses, version 1\n# model = ball\n# height_m = 1.7\n"
        "frame,hinge.bend_deg,root.z_m,root.y_m,root.x_m,root.qx,root.qy,root.qz,root.qw\n0,180,3,2,1,0,0,0,1\n"
    )
    np.testing.assert_allclose(read_pose_table(path).values_for(model), [[1, 2, 3, 1, 0, 0, 0, np.pi]])


def test_values_of_another_model(tmp_path):
    model = parse_model(BALL, "ball")
    write_pose_table(tmp_path / "a.csv", model, np.zeros((1, 8)))
    assert read_pose_table(tmp_path / "a.csv").values_for(load_model("gavrila22")) is None


GOOD = "# quadrille poses, version 1\n# model = ball\n# height_m = 1.7\nframe,hinge.bend_deg\n0,1\n1,2\n"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("version 1", "version 2", "version 2, this program reads up to 1; upgrade"),
        ("# quadrille poses", "# poses", "not a table of poses"),
        ("# model = ball\n", "", "expected '# model = NAME'"),
        ("1.7", "tall", "height_m = METRES"),
        ("frame,", "row,", "line 4: expected 'frame'"),
        ("_deg", "", "line 4: column 'hinge.bend' has no unit"),
        ("1,2", "1,x", "line 6: expected numbers.*'x'"),
        ("1,2", "1,2,3", "line 6: expected 2 columns, found 3"),
        ("1,2", "1", "line 6: expected 2 columns, found 1"),
        ("1,2", "1,nan", "line 6, column 2: expected a finite number within 1e\\+09, found nan"),
        ("1,2", "1,inf", "line 6, column 2"),
        ("1,2", "1,1e300", "line 6, column 2"),
        ("1,2", "1.5,2", "line 6: expected a whole frame number of at most 10000000 first, found 1.5"),
        ("1,2", "1e300,2", "line 6: expected a whole frame number"),
        ("0,1", "-1,1", "expected frames from 0, found -1"),
        ("1,2", f"1,{'2' * 140_000}", "line 6: field larger than field limit"),
        ("1,2", f"1,{'2' * 1_100_000}", "line 6: expected at most 1000000 characters"),
        ("_deg", "_deg,hinge.bend_deg", "line 4: expected 1 to 2000 columns of values, each once"),
        ("version 1", "version ²", "not a table of poses"),
        ("1.7", "inf", "height_m = METRES"),
        ("1,2", "0,2", "line 6: expected frame numbers that rise from row to row"),
    ],
)
def test_malformed(tmp_path, old, new, expected):
    path = tmp_path / "a.csv"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(FormatError, match=expected):
        read_pose_table(path)


def test_missing(tmp_path):
    with pytest.raises(FormatError, match="not found"):
        read_pose_table(tmp_path / "none.csv")
