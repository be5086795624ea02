"""A rescue file is written into a store as it was, or refused by one sentence, whatever its valid checksum covers."""

import hashlib
import json
import os
import random

import numpy as np
import pytest
from mutation import mutate_tree

from app.storage import rescue
from app.storage.rescue_file import Model, Rescue, UnsavedEdit, read_rescue, write_rescue
from app.storage.shared_storage import RetryQueue
from tracker.body.limbs import Search
from tracker.errors import SessionError
from tracker.formats.model_toml import format_model, load_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, AssessmentChange, MarkChange, PinChange, PoseChange, PoseRecord

MODEL = load_model("gavrila22")
N_VALUES = len(MODEL.value_names)


@pytest.fixture
def store(tmp_path):
    with AnnotationStore(tmp_path / "annotations.sqlite") as store:
        yield store


def written(tmp_path, store):
    """A rescue file with changes of all kinds."""
    n, seen = N_VALUES, {"head": {"a": [1, 2]}}
    pose = PoseRecord(
        np.linspace(0, 1, n), ("manual",) * n, 3, keyframe=True, cost_px=1.5, settings={"seen": seen},
        view_costs_px=(1.0, None), part_costs_px=(0.5,), limbs_lost=(0.25,),
        trace=(Search("limbs", ("left_arm",), 4.0, None, False),),
    )  # fmt: skip
    changes = [
        PoseChange("ann", 4, pose, (Alternative(pose.values + 1, 3, 2.0),)),
        PoseChange("ann", 5, None),
        MarkChange("ann", 4, keyframe=True, reviewed=False),
        AssessmentChange("ann", 4, pose.values, "lost", "left arm uncertain", (0.5,), np.array([np.eye(3)])),
        PinChange("ann", 4, "head", "front", (10.5, 3.25)),
        PinChange("ann", 4, "left_wrist", "front", None),
    ]
    path = tmp_path / "rescue.json"
    models = {3: Model("ann", format_model(MODEL))}
    edits = [UnsavedEdit("drag head", changes, None, False), UnsavedEdit("track", changes[:1], 1, True, "ben")]
    write_rescue(path, Rescue(str(tmp_path), store.id, "eve", "2026-03-01", "the disk is full", models, edits))
    return path


def signed(text):
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text + b"\n"


def test_it_is_read_as_it_was_written(tmp_path, store):
    found = read_rescue(written(tmp_path, store))
    edit = found.edits[0]
    assert (edit.label, edit.by_program, found.edits[1].amend) == ("drag head", False, 1)
    assert [e.author for e in found.edits] == [None, "ben"]
    np.testing.assert_array_equal(edit.changes[0].pose.values, np.linspace(0, 1, N_VALUES))
    assert edit.changes[0].pose.view_costs_px == (1.0, None)
    assert edit.changes[0].pose.trace == (Search("limbs", ("left_arm",), 4.0, None, False),)
    np.testing.assert_array_equal(edit.changes[3].errors, [np.eye(3)])
    assert edit.changes[4] == PinChange("ann", 4, "head", "front", (10.5, 3.25))


@pytest.mark.parametrize(
    "text",
    [b"", b"[]", b"7", b"{", b"\xff", b"[" * 100_000, b'{"version": 1}', b'{"version": [1]}', b'{"version": 1e400}'],
    ids=lambda text: str(text[:12]),
)
def test_contents_that_are_no_rescue(tmp_path, text):
    path = tmp_path / "rescue.json"
    path.write_bytes(signed(text))
    with pytest.raises(SessionError, match=r"rescue file .* (holds what no program writes|has version)"):
        read_rescue(path)


def test_edits_of_several_people_keep_their_authors(tmp_path, store, monkeypatch):
    def fail(*args, **kwargs):
        raise SessionError("the disk is full")

    store.add_model_revision("ann", format_model(MODEL))
    queue = RetryQueue(store)
    with monkeypatch.context() as full:
        full.setattr(store, "commit", fail)
        for frame, author in enumerate(("anna", "ben", "anna")):
            queue.write(f"clear {frame}", [PoseChange("ann", frame, None)], None, False, author)
    path = tmp_path / "rescue.json"
    write_rescue(path, Rescue(str(tmp_path), store.id, "anna", "2026-03-01", "the disk is full", {}, queue.edits))
    assert rescue.replay(path, tmp_path, store) == 3
    assert [(e.label, e.author) for e in store.history()] == [
        ("clear 2", "anna"),
        ("clear 1", "ben"),
        ("clear 0", "anna"),
    ]


def test_edits_of_a_former_version_are_of_the_author_of_the_file(tmp_path, store):
    path = written(tmp_path, store)
    data = json.loads(path.read_bytes().partition(b"\n")[2])
    for edit in data["edits"]:
        edit.pop("author")
    path.write_bytes(signed(json.dumps(data).encode()))
    rescue.replay(path, tmp_path, store)
    assert {e.author for e in store.history()} == {"eve"}


def with_pose(**changes):
    def change(data):
        data["edits"][0]["changes"][0]["of"]["pose"].update(changes)

    return change


def with_change(index, **changes):
    return lambda data: data["edits"][0]["changes"][index]["of"].update(changes)


def with_camera(name):
    def change(data):
        data["edits"][0]["changes"][4]["of"][3] = name

    return change


def with_assessed_status(status):
    def change(data):
        data["edits"][0]["changes"][3]["of"][3] = status

    return change


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (with_pose(values=[1.0, 2.0]), "'ann' in frame 4 does not fit its body"),
        (with_pose(values={"a": 1}), "Expected `array`"),
        (with_pose(values=[[1.0]] * N_VALUES), "Expected `array`, got `float`"),
        (with_pose(values=["1"] * N_VALUES), "Expected `float`"),
        (with_pose(model_revision=4), "has a body that the file lacks"),
        (with_pose(sources=["manual"]), "impossible sources"),
        (with_pose(sources=["magic"] * N_VALUES), "impossible sources"),
        (with_pose(status="fine"), "impossible sources, marks"),
        (with_pose(limbs_lost=[7.0]), "impossible sources"),
        (with_change(0, frame=-1), "expected a frame from 0 to"),
        (with_change(0, frame=2**70), "expected a frame from 0 to"),
        (with_change(0, person="bob"), "has a body that the file lacks"),
        (with_camera("a\x1b[2J"), "Expected `str` matching"),
        (with_assessed_status("fine"), "the assessment of 'ann' in frame 4 is impossible"),
        (lambda data: data["models"].update({"3": {"person": "ann", "toml": "x = 1"}}), "revision 3"),
        (lambda data: data["edits"][0].update(amend=2**70), "amend"),
        (lambda data: data["edits"][0].update(label="\x9b2J"), "label"),
        (lambda data: data["edits"][0].update(author="\x9b2J"), "author"),
        (lambda data: data["edits"][0]["changes"][0].update(kind="tail"), "tail"),
    ],
)
def test_impossible_values_are_named(tmp_path, store, change, expected):
    path = written(tmp_path, store)
    data = json.loads(path.read_bytes().partition(b"\n")[2])
    change(data)
    path.write_bytes(signed(json.dumps(data).encode()))
    with pytest.raises(SessionError) as caught:
        rescue.replay(path, tmp_path, store)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
    assert store.history() == []
    assert path.exists()


def test_a_named_pipe_in_place_of_a_rescue_file(tmp_path):
    os.mkfifo(tmp_path / "rescue.json")
    with pytest.raises(SessionError, match="cannot be read: expected a regular file, found a named pipe"):
        read_rescue(tmp_path / "rescue.json")


@pytest.mark.slow
def test_mutated_files_are_written_or_refused(tmp_path, store):
    """Every file has a valid checksum; a traceback would fail the test."""
    rng = random.Random("rescue")
    path = written(tmp_path, store)
    whole = json.loads(path.read_bytes().partition(b"\n")[2])
    written_ones, refused = 0, []
    for _ in range(300):
        path.write_bytes(signed(json.dumps(mutate_tree(rng, whole)).encode("utf-8", "replace")))
        try:
            rescue.replay(path, tmp_path, store)
            written_ones += 1
        except SessionError as error:
            refused.append(str(error))
    assert written_ones > 0
    assert len(refused) > 100
    assert max(map(len, refused)) < 2000
    with AnnotationStore(tmp_path / "annotations.sqlite", read_only=True) as again:
        for frame in again.frames("ann"):
            assert len(again.pose("ann", frame.frame).values) == N_VALUES
