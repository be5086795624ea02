"""A session of the program as it was before its modules moved into rooms opens with the same poses, pins and history.

`session_before_rooms` was made by that program on the sample `elbow_rotation`: a first pose from joints, drags, pins,
new sizes with a refitted keyframe, seven tracked frames, two edits undone, two locks. `expected.json` is what that
program read back: the history, and poses and pins after each undo.
"""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

HERE = Path(__file__).with_name("session_before_rooms")
SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "elbow_rotation"


@pytest.fixture
def session(tmp_path):
    """The session with its footage."""
    folder = Path(shutil.copytree(SAMPLE, tmp_path / "session"))
    shutil.copytree(HERE, folder, dirs_exist_ok=True)
    return folder


@pytest.fixture
def expected():
    return json.loads((HERE / "expected.json").read_text("utf-8"))


def assert_shows(store, step):
    assert {row.frame for row in store.frames("person")} == {int(frame) for frame in step["poses"]}
    for frame, pose in step["poses"].items():
        found = store.pose("person", int(frame))
        np.testing.assert_allclose(found.values, pose["values"], rtol=1e-9)
        assert (found.status, found.model_revision) == (pose["status"], pose["model_revision"])
        assert found.cost_px == (None if pose["cost_px"] is None else pytest.approx(pose["cost_px"]))
    assert [[p.point, p.camera, list(p.position_px)] for p in store.pins("person", 0)] == step["pins"]


def test_poses_pins_and_history_are_the_same_through_every_undo(session, expected):
    loaded = load_session(session)
    assert [p.name for p in loaded.people] == ["person"]
    with AnnotationStore(loaded.annotations_path) as store:
        assert [entry.label for entry in store.history()] == expected["history"]
        for i, step in enumerate(expected["steps"]):
            if i:
                store.undo()
            assert_shows(store, step)
        for step in reversed(expected["steps"][:-1]):
            store.redo()
            assert_shows(store, step)
