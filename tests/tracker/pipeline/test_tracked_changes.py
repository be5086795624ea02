import json

import numpy as np

from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import AlternativePose, PoseEstimate
from tracker.pipeline.methods import METHODS, make_tracker
from tracker.pipeline.tracked_changes import StoredPerson, recorded_method, settings_record, tracked_changes
from tracker.session.store.annotation_store import AnnotationStore


def estimate(other):
    """Of a man and a woman, who may have another pose."""
    return PoseEstimate(
        4, (np.zeros(2), np.ones(2)), 1.0, np.ones(4), 9, ("good", "doubtful"), ("", "left arm may be elsewhere"),
        (np.ones(3),) * 2, (np.eye(2),) * 2, (None, None), ((), (other,)), "chamfer",
    )  # fmt: skip


def test_alternatives_are_stored_with_the_pose(tmp_path):
    store = AnnotationStore(tmp_path / "annotations.sqlite")
    people = [StoredPerson(name, store.add_model_revision(name, "a = 1")) for name in ("man", "woman")]
    other = AlternativePose(np.array([7.0, 8.0]), 1.25)
    changes = tracked_changes([estimate(other)], people, [0, 1], {}, TrackSettings())
    store.commit("track", changes, by_program=True)
    assert store.alternatives("man", 4) == ()
    (kept,) = store.alternatives("woman", 4)
    np.testing.assert_array_equal(kept.values, other.values)
    assert (kept.model_revision, kept.cost_px) == (people[1].revision, 1.25)
    store.close()


def test_keyframes_and_people_who_are_not_tracked_are_not_written():
    found, people = estimate(AlternativePose(np.zeros(2), 1.0)), [StoredPerson("man", 1), StoredPerson("woman", 2)]
    for tracked, keyframes, expected in (
        ([0, 1], {4: {1: np.ones(2)}}, ["man"]),
        ([0, 1], {3: {1: np.ones(2)}}, ["man", "woman"]),
        ([1], {}, ["woman"]),
    ):
        changes = tracked_changes([found], people, tracked, keyframes, TrackSettings())
        assert [c.person for c in changes] == expected


def test_stored_settings_name_their_method():
    for method in METHODS:
        assert make_tracker(METHODS[method].settings()).settings.method == method
    record = json.loads(json.dumps(settings_record(TrackSettings())))
    assert recorded_method(record) == record.pop("method") == "chamfer"
    assert recorded_method(record) == "chamfer"  # as former versions stored them
