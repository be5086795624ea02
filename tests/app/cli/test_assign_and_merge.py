"""`quadrille assign`, `tasks` and `merge`: from a plan through two blind copies to verified frames."""

import json
import shutil

import numpy as np
import pytest
from command_line import assert_refused, stored

from tracker.formats.model_toml import format_model
from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.pipeline.calibration_revisions import (
    change_calibration,
    follow_history,
    same_calibration,
    with_corrections,
)
from tracker.session.session import create_session, load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import revisions_of_poses
from tracker.session.store.records import PinChange, PoseChange, PoseRecord


def annotate(folder, x, frames, author, keyframe=True):
    """Set poses that stand `x` metres from the origin, with a pin each."""
    (person,) = load_session(folder).people
    values = person.model.neutral()
    values[0] = x
    with AnnotationStore(folder / "annotations.sqlite", author=author) as store:
        revision = store.add_model_revision(person.name, format_model(person.model))
        record = PoseRecord(values, ("manual",) * len(values), revision, keyframe=keyframe, status="lost")
        for k in frames:
            pin = PinChange(person.name, k, "left_wrist", "BACK", (x, 1.0))
            store.commit(f"Set frame {k}", [PoseChange(person.name, k, record), pin])


def asked(result):
    status, out, err = result
    assert (status, err) == (0, "")
    return json.loads(out)


def content(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_names_of_annotators_have_one_form(run, session):
    """A Mac types a letter and its accent apart, and nobody sees a second space."""
    plan = ("assign", session, "--frames", "0:3", "--json")
    tasks = asked(run(*plan, "--to", "Jose\u0301  M ", "--annotator", " Jose\u0301  M"))["tasks"]
    assert {t["annotator"] for t in tasks} == {"Jos\u00e9 M"}
    annotate(session, 0.1, [0], None)
    assert run("tasks", session, "--of", "Jose\u0301 M ")[1].splitlines()[2] == "  annotated    1: 0"
    speed = asked(run("tasks", session, "--json"))["speed"]
    assert set(speed) == {"Jos\u00e9 M"}
    assert_refused(run(*plan, "--to", "Jose\u0301", "Jos\u00e9"), ["each annotator once"])
    assert_refused(run(*plan, "--to", " "), ["expected an annotator", "--to"])
    assert_refused(run(*plan, "--to", 61 * "a"), ["at most 60 visible characters"])


def test_a_plan_is_shown_and_grows(run, session):
    assert run("assign", session)[1] == "no tasks are planned\n"
    found = asked(run("assign", session, "--every", "20", "--to", "anna", "ben", "--annotator", "lead", "--json"))
    assert found["counts"] == {"draft": 3, "annotated": 0, "verified": 0, "rejected": 0, "total": 3}
    assert [(t["frame"], t["annotator"]) for t in found["tasks"]] == [(0, "anna"), (20, "ben"), (40, "anna")]
    assert asked(run("assign", session, "--frames", "0,2:4", "--to", "anna", "--json"))["added"] == 2
    annotate(session, 0.1, [0, 3], "anna")
    assert run("tasks", session, "--of", "anna")[1].splitlines() == [
        "person, anna:", "  draft        2: 2, 40", "  annotated    2: 0, 3", "0 of 4 verified",
    ]  # fmt: skip
    assert run("tasks", session, "--verify", "--frame", "3", "--annotator", "rita")[1].endswith("1 of 5 verified\n")
    assert run("tasks", session, "--reject", "left elbow", "--frame", "0")[0] == 0
    (rejected,) = [t for t in asked(run("tasks", session, "--json"))["tasks"] if t["state"] == "rejected"]
    assert (rejected["frame"], rejected["comment"], rejected["by"]) == (0, "left elbow", "rita")  # remembered
    speed = asked(run("tasks", session, "--json"))["speed"]
    assert (speed["rita"]["decisions"], speed["rita"]["verified"], speed["anna"]["verified"]) == (2, 0, 1)
    assert speed["anna"]["edits_per_verified"] == speed["anna"]["edits"]
    run("tasks", session, "--comment", "see the hand", "--frame", "0", "--limb", "left_forearm")
    (comment,) = asked(run("tasks", session, "--json"))["comments"]
    assert "person, frame 0, left arm: see the hand (rita)" in run("tasks", session)[1]
    assert "see the hand" not in run("tasks", session, "--resolve", comment["uid"][:6])[1]


def test_frames_are_planned_by_their_poses(run, session):
    annotate(session, 0.1, range(3, 7), "", keyframe=False)
    assert asked(run("assign", session, "--doubted", "--json"))["counts"]["draft"] == 4
    assert asked(run("assign", session, "--diverse", "2", "--to", "anna", "--json"))["added"] == 1  # all are alike


def test_two_annotators_work_blind_and_their_copies_are_merged(run, session, tmp_path):
    annotate(session, 8.5, [0, 20], "lead")
    annotate(session, 9.0, [1], "lead")
    a, b, c = (tmp_path / name for name in ("anna", "ben", "both"))
    words = ["--every", "20", "--to", "anna", "ben", "--each", "--blind", a, b, "--repeat", "1", "--json"]
    copies = asked(run("assign", session, *words))["copies"]
    assert [(x["annotator"], x["tasks"], x["pass"]) for x in copies] == [
        ("anna", 3, 1), ("anna", 1, 2), ("ben", 3, 1), ("ben", 1, 2),
    ]  # fmt: skip
    for folder in (a, b, tmp_path / "anna_pass_2"):
        assert sorted(stored(folder)) == [1]
        with AnnotationStore(folder / "annotations.sqlite") as store:
            store.go_to(None)  # nothing of the planned frames is in the history either
            assert store.pins("person", 0) == []
            assert store.redo() == "Set frame 0"
            assert store.pose("person", 0) is None
            while store.redo() is not None:
                pass
        raw = (folder / "annotations.sqlite").read_bytes()
        assert np.array([9.0]).tobytes() in raw
        assert np.array([8.5]).tobytes() not in raw
    annotate(a, 1.0, [0, 20], "anna")
    annotate(b, 1.05, [0, 40], "ben")
    before = content(a), content(b)
    found = asked(run("merge", a, b, "--into", c, "--json"))
    assert (content(a), content(b)) == before
    assert found["only_in"] == [2, 2]
    (disagreement,) = found["disagreements"]
    assert (disagreement["frame"], disagreement["shown"], disagreement["alternative"]) == (0, "ben", "anna")
    assert disagreement["apart_mm"] == pytest.approx(50)
    assert {k: (p.values[0], p.author) for k, p in stored(c).items()} == {
        0: (1.05, "ben"), 1: (9.0, "lead"), 20: (1.0, "anna"), 40: (1.05, "ben"),
    }  # fmt: skip
    assert (
        asked(run("merge", a, b, "--into", tmp_path / "coarse", "--tolerance-mm", "60", "--json"))["disagreements"]
        == []
    )
    with_session = asked(run("merge", c, session, "--into", tmp_path / "all", "--json"))
    assert [(d["frame"], d["shown"]) for d in with_session["disagreements"]] == [(0, "ben"), (20, "anna")]


def test_no_blind_copy_is_written_if_one_folder_is_in_use(run, session, tmp_path):
    a, b = tmp_path / "anna", tmp_path / "ben"
    words = ["assign", session, "--every", "20", "--to", "anna", "ben", "--blind"]
    for used in (b, tmp_path / "ben_pass_2"):
        used.mkdir()
        (used / "notes.txt").write_text("mine", "utf-8")
        before = content(session)
        assert_refused(run(*words, a, b, "--repeat", "1"), [f"{used} exists already"])
        shutil.rmtree(used)
        assert content(session) == before
    assert_refused(run(*words, a, a), ["expected a folder for each copy", "twice"])
    assert list(tmp_path.glob("*anna*")) == []


def observe(folder, name, text):
    """Store something under the name of observations."""
    at = folder / "observations" / name
    at.mkdir(parents=True)
    (at / "observations.toml").write_text(f'version = 1\nname = "{name}"\n', "utf-8")
    (at / "points.npz").write_text(text, "utf-8")


def observed(folder):
    """Return the files that `observe` stores, by name."""
    found = {at.name: (at / "points.npz").read_text("utf-8") for at in (folder / "observations").iterdir()}
    for name in found:
        assert f'name = "{name}"' in (folder / "observations" / name / "observations.toml").read_text("utf-8")
    return found


def test_observations_of_one_name_with_other_content_are_both_kept(run, session, tmp_path):
    a, b = tmp_path / "anna", tmp_path / "ben"
    annotate(session, 1.0, [0], "lead")
    observe(session, "detector", "of both")
    for folder, x in ((a, 1.0), (b, 2.0)):
        shutil.copytree(session, folder)
        observe(folder, "rtmpose", f"of {folder.name}")
        annotate(folder, x, [1], folder.name)
    (note,) = asked(run("merge", a, b, "--into", tmp_path / "ab", "--json"))["notes"]
    assert note == f"both copies have other observations 'rtmpose': those of {a} are 'rtmpose_2' now"
    assert note in run("merge", b, a, "--into", tmp_path / "ba")[1]
    kept = {"detector": "of both", "rtmpose": "of ben", "rtmpose_2": "of anna"}
    assert observed(tmp_path / "ab") == observed(tmp_path / "ba") == kept
    again = asked(run("merge", tmp_path / "ab", a, "--into", tmp_path / "again", "--json"))
    assert (again["notes"], observed(tmp_path / "again")) == ([], kept)


def test_copies_of_a_session_that_nobody_had_opened_are_merged(run, session, tmp_path):
    base, anna, ben = tmp_path / "base", tmp_path / "anna", tmp_path / "ben"
    made = load_session(session)
    create_session(base, cameras=made.cameras, people=made.people, fps=made.fps, n_frames=made.n_frames)
    for folder, frame in ((anna, 10), (ben, 40)):
        shutil.copytree(base, folder)
        annotate(folder, 1.0, [frame], folder.name)
    found = asked(run("merge", anna, ben, "--into", tmp_path / "both", "--json"))
    assert found["edits"] == 2
    assert sorted(stored(tmp_path / "both")) == [10, 40]
    assert load_session(tmp_path / "both").uid == load_session(base).uid
    assert run("merge", base, anna, "--into", tmp_path / "one")[0] == 0, "one of them is still untouched"
    assert sorted(stored(tmp_path / "one")) == [10]
    (ben / "identity.txt").unlink()
    assert_refused(run("merge", anna, ben, "--into", tmp_path / "no"), ["without a common edit"])


def test_a_folder_that_is_no_copy_is_refused(run, session, tmp_path):
    annotate(session, 1.0, [0], "anna")
    copy, into = tmp_path / "copy", tmp_path / "into"
    shutil.copytree(session, copy)
    (copy / "annotations.sqlite").unlink()
    (copy / "identity.txt").unlink()
    annotate(copy, 1.0, [0], "anna")
    assert_refused(run("merge", session, copy, "--into", into), ["without a common edit in their histories"])
    toml = copy / "session.toml"
    text = toml.read_text("utf-8")
    toml.write_text(text.replace('name = "person"', 'name = "other"'), "utf-8")
    assert_refused(run("merge", session, copy, "--into", into), ["found other people: person in", "other in"])
    toml.write_text(text.replace("n_frames = ", "n_frames = 1"), "utf-8")
    assert_refused(run("merge", session, copy, "--into", into), ["found other numbers of frames"])
    assert not into.exists()
    assert_refused(run("merge", session, session, "--into", copy), ["exists already and is not an empty folder"])


def test_the_merged_session_has_the_body_and_the_calibration_of_its_history(run, session, tmp_path):
    annotate(session, 1.0, [0], "lead")
    a, b, into = tmp_path / "a", tmp_path / "b", tmp_path / "into"
    shutil.copytree(session, a)
    shutil.copytree(session, b)
    assert run("body", a, "--to", "gavrila38")[0] == 0
    loaded = load_session(b)
    corrections = np.zeros((len(loaded.cameras), N_CORRECTIONS))
    corrections[0, 1] = 0.02
    with AnnotationStore(b / "annotations.sqlite") as store:
        changed = change_calibration(loaded, store, with_corrections(loaded, corrections), "calibrate")
    annotate(a, 2.0, [1], "anna")
    annotate(b, 2.0, [2], "ben")
    assert run("merge", a, b, "--into", into)[0] == 0
    found = load_session(into)
    assert found.people[0].model.name == "gavrila38"
    assert same_calibration(found, changed)
    with AnnotationStore(into / "annotations.sqlite") as store:
        assert revisions_of_poses(store, "person") == {0: 1, 1: 1, 2: 2}
        assert follow_history(found, store) is found


@pytest.mark.parametrize(("file", "before", "after", "expected"), [
    ("calibration.toml", "481.58", "482.58", ["found other calibrations in", "give both the same calibration.toml"]),
    ("models/person.toml", "height_m = 1.78", "height_m = 1.88", ["found other bodies of person in", "give both"]),
])  # fmt: skip
def test_changes_that_the_history_does_not_know_are_refused(run, session, tmp_path, file, before, after, expected):
    annotate(session, 1.0, [0], "lead")
    copy, into = tmp_path / "copy", tmp_path / "into"
    shutil.copytree(session, copy)
    text = (copy / file).read_text("utf-8")
    assert before in text
    (copy / file).write_text(text.replace(before, after), "utf-8")
    assert_refused(run("merge", session, copy, "--into", into), expected)
    assert not into.exists()


@pytest.mark.parametrize(("words", "expected"), [
    (["assign", "--every", "0"], ["--every as a whole number from 1, found 0"]),
    (["assign", "--every", "2", "--doubted"], ["expected one of --every, --frames, --diverse and --doubted, found 2"]),
    (["assign", "--frames", "0,5000"], ["expected --frames such as 0,40,100:110", "found '5000'"]),
    (["assign", "--diverse", "3"], ["expected poses of person to choose from, found none"]),
    (["assign", "--to", "a", "a"], ["expected each annotator once"]),
    (["assign", "--to", "a", "--blind", "x", "y"], ["found 2 and 1"]),
    (["assign", "--repeat", "2"], ["expected --blind beside --repeat"]),
    (["tasks"], ["found no annotations; run quadrille assign first"]),
    (["tasks", "--verify", "--reject", "x", "--frame", "1"], ["expected one thing to do"]),
    (["tasks", "--verify"], ["expected --frame from 0 to", "found None"]),
    (["tasks", "--reject", " ", "--frame", "1"], ["expected the reason with --reject"]),
    (["tasks", "--comment", "x", "--frame", "1", "--limb", "tail"], ["expected --limb as one of"]),
])  # fmt: skip
def test_an_impossible_plan_is_refused(run, session, words, expected):
    command, *options = words
    assert_refused(run(command, session, *options), expected)
