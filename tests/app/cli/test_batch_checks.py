"""`quadrille batch` checks a plan and its table before anything is written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from clips import SIZE, encode
from command_line import assert_refused
from staging import cameras_around

from tracker.batch.checks import problems
from tracker.batch.plan import read_plan
from tracker.batch.table import Footage
from tracker.formats.anipose import write_calibration


@pytest.fixture
def lab(tmp_path):
    """A calibration of two cameras, and their videos in a folder."""
    lens = np.array([[64.0, 0.0, 31.5], [0.0, 64.0, 23.5], [0.0, 0.0, 1.0]])
    cameras = [
        replace(c, name=name, K=lens) for name, c in zip(("FRONT", "LEFT"), cameras_around(2, size=SIZE), strict=True)
    ]
    write_calibration(tmp_path / "Calib.toml", cameras)
    (tmp_path / "foot").mkdir()
    for camera in cameras:
        encode(tmp_path / "foot" / f"{camera.name}.avi", n=4)
    (tmp_path / "plan.toml").write_text('table = "t.csv"\nsettings = {frames = "0:2"}')
    return tmp_path


VIDEOS = "foot/FRONT.avi;foot/LEFT.avi"


@pytest.mark.parametrize(
    "text",
    [
        f'\ufeffname;calibration;videos;height\r\nrec1;Calib.toml;"{VIDEOS}";1,8\r\n',
        f'sep=;\r\nname;calibration;videos;height\r\nrec1;Calib.toml;"{VIDEOS}";1,8\r\n',
        f"name\tcalibration\tvideos\theight\nrec1\tCalib.toml\t{VIDEOS}\t1.8\n",
        f"name,calibration,videos,height\nrec1,Calib.toml,{VIDEOS},1.8\n".replace("/", "\\"),
        "name,calibration,videos,height\nrec1,Calib.toml,foot/*.avi,1.8\n",
        "name,calibration,videos,height\nrec1,Calib.toml,foot\\*.avi,1.8\n",
        f"Name,Calibration, VIDEOS ,Height\nrec1,Calib.toml,{VIDEOS},1.8\n,,,\n",
        f"name,calibration,videos,height,notes\nrec1,Calib.toml,{VIDEOS},1.8,good\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_table_of_a_spreadsheet_program_is_read(lab, text, encoding):
    (lab / "t.csv").write_bytes(text.removeprefix("\ufeff" * (encoding == "utf-16")).encode(encoding))
    plan = read_plan(lab / "plan.toml", lab / "out")
    (one,) = plan.recordings
    assert problems(plan) == []
    assert one.footage == Footage(f"{lab}/Calib.toml", (f"{lab}/foot/FRONT.avi", f"{lab}/foot/LEFT.avi"), height_m=1.8)
    assert plan.unread == (("notes",) if "notes" in text else ())


WRONG = {
    "gone,Calib.toml,foot/X.avi;foot/LEFT.avi,1.8": "gone: expected files and folders that exist, found none at {}",
    "cal,foot,foot/*.avi,1.8": "cal: ",
    "tall,Calib.toml,foot/*.avi,180": "person of 0.6 to 2.3 metres, found 180; is it in centimetres? say 1.8",
    "num,Calib.toml,foot/*.avi,tall": "line 5: expected a number as 'height', found 'tall'",
    "no,Calib.toml,foot/*.mov,1.8": "line 6: expected videos at 'foot/*.mov', found none",
    f"{'l' * 300},Calib.toml,foot/*.avi,1.8": "line 7: the name of a folder: expected a name of 1 to 100 characters",
    "../x,Calib.toml,foot/*.avi,1.8": "line 8: the name of a folder: expected",
    "ok,Calib.toml,foot/*.avi,1.8": "",
    "ok,Calib.toml,foot/FRONT.avi,1.8": "line 10: expected a name of its own, found 'ok' a second time",
    "many,Calib.toml,foot/FRONT.avi,foot/LEFT.avi,1.8": "line 11: expected a cell for each of 4 columns, found '1.8'",
    "none,,foot/*.avi,1.8": "line 12: expected a value as 'calibration', found none",
    "who,Calib.toml,foot/*.avi,1.8": "who: expected people among person, found 'nobody'",
    "when,Calib.toml,foot/*.avi,1.8": "when: expected frames as A:B within 0:4",
    "what,Calib.toml,foot/*.avi,1.8": "what: expected formats among trc, ",
    "how,Calib.toml,foot/*.avi,1.8": "how: expected options among ",
    "with,Calib.toml,foot/*.avi,1.8": "with: expected the name of imported observations as 'keypoints', among none",
}  # fmt: skip
"""Rows that cannot be tracked, with what is said of each."""


@pytest.mark.parametrize(
    "way", ["--check", *(pytest.param(w, marks=pytest.mark.slow) for w in ("--slurm", "--workers"))]
)
def test_all_problems_are_listed_before_anything_is_written(lab, run, way):
    (lab / "t.csv").write_text("\n".join(["name,calibration,videos,height", *WRONG]))
    (lab / "plan.toml").write_text("""
        table = "t.csv"
        recordings.who.people = ["nobody"]
        recordings.when.frames = "0:9"
        recordings.what.export = ["trx"]
        recordings.how.options = {speed = 3}
        recordings.with.keypoints = "x"
    """)
    status, out, err = run("batch", lab / "plan.toml", way, *["1"] * (way == "--workers"))
    said = err[err.index("quadrille: ") :].splitlines()
    assert (status, out) == (1, "")
    assert f"found {len(WRONG) - 1} that cannot:" in said[0]
    assert len(said) == len(WRONG) + 1
    for words in filter(None, WRONG.values()):
        assert sum(words.format(lab) in line for line in said) == 1, words
    assert not (lab / "plan_batch").exists()
    report = json.loads(run("batch", lab / "plan.toml", "--check", "--json")[1])
    assert len(report["problems"]) == len(WRONG) - 1


def test_a_sound_plan_is_checked_and_nothing_is_written(lab, run):
    (lab / "t.csv").write_text("name,calibration,videos,notes\na,Calib.toml,foot/*.avi,good\n")
    status, out, err = run("batch", lab / "plan.toml", "--check")
    assert (status, out) == (0, "all recordings can be tracked: 1, of which 0 have ended\n")
    assert "columns of the table that are not read: notes" in err
    assert not (lab / "plan_batch").exists()


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("name,calibration,videos,hight", "correct 'hight'"),
        ("name,calibration,videos,Name", "correct 'name'"),
        ("name;calibration", "correct 'videos'"),
    ],
)
def test_a_column_that_seems_misspelt_is_no_remark(lab, run, header, words):
    (lab / "t.csv").write_text(header)
    assert_refused(run("batch", lab / "plan.toml", "--check"), ["expected columns name, calibration", words])
