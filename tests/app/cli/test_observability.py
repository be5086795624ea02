"""`quadrille observability`: a sentence for each degree of freedom, medians over frames, and one more camera."""

import json
import re
import shutil

import pytest
from command_line import SAMPLE, assert_refused


@pytest.mark.slow
def test_one_frame_and_another_camera(run, placed):
    status, out, err = run("observability", placed, "--frame", "20", "--another-camera", "--json")
    report = json.loads(out)
    assert (status, err) == (0, "")
    assert report.keys() == {"person", "frames", "rank", "dofs", "another_camera"}
    assert (report["frames"], report["rank"]) == ([20], len(report["dofs"]))
    dofs = {d["name"]: d for d in report["dofs"]}
    assert dofs["torso.x"]["unit"] == "m"
    assert dofs["torso.x"]["sigma"] < 0.05
    assert dofs["left_elbow.extension"]["sentence"].startswith("extension of the left elbow: ")
    assert dofs["left_elbow.extension"]["best_view"] in ("FRONT", "RIGHT", "BACK", "LEFT")
    best, *_, last = report["another_camera"]
    assert best["mean_after_deg"] < last["mean_after_deg"] < best["mean_before_deg"]


def test_the_sentence_for_a_person(run, placed):
    _, out, _ = run("observability", placed, "--another-camera")
    lines = out.splitlines()
    assert lines[0].startswith("person, frame 20: ")
    assert sum(line.startswith("another camera at (") for line in lines) == 3
    assert any("left elbow.extension" in line and "view" in line for line in lines)
    _, out, _ = run("observability", placed, "--frames", "0:50")
    assert "medians over 1 frames" in out or "frame 20" in out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--frame", "3"), ["stored pose of 'person' in frame 3, found none", "init and track"]),
        (("--frame", "3", "--frames", "0:4"), ["--frame or --frames, found both"]),
        (("--frames", "40:60"), ["A:B within 0:50"]),
    ],
)
def test_refused(run, placed, words, expected):
    assert_refused(run("observability", placed, *words), expected)


@pytest.mark.slow
def test_all_people_with_a_pose_are_listed(run, tmp_path):
    tango = shutil.copytree(SAMPLE.with_name("tango"), tmp_path / "tango")
    for name, others in (("man", "expected a stored pose of 'woman'"), ("woman", "woman, frame 0: ")):
        poses = ("--method", "poses", "--poses", tango / f"first_pose_{name}.csv", "--frame", "0")
        assert run("init", tango, *poses, "--person", name, "--json")[0] == 0
        assert re.match(rf"man, frame 0: .*\n{others}", run("observability", tango)[1], re.DOTALL)
    assert [one["person"] for one in json.loads(run("observability", tango, "--json")[1])["people"]] == ["man", "woman"]
