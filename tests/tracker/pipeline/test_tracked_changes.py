import json
from contextlib import closing
from dataclasses import replace

import numpy as np

from tracker.formats.model_toml import format_model, load_model
from tracker.pipeline.methods import METHODS, make_tracker
from tracker.pipeline.tracked_changes import (
    StoredPerson,
    poses_to_replace,
    recorded_method,
    settings_record,
    tracked_changes,
)
from tracker.session.session import Person
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import AlternativePose, PoseEstimate


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


def simple_poses_to_replace(store, people, frames, tracked, settings):
    """As `poses_to_replace`, but reads all that is stored of each pose. The calibration has never been changed."""
    same, found = json.loads(json.dumps(settings_record(settings))), {}
    for i in tracked:
        bodies = {
            body.id for body in store.model_revisions(people[i].name) if body.toml == format_model(people[i].model)
        }
        for frame, record in store.poses(people[i].name, range(min(frames), max(frames) + 1)).items():
            is_same = all(record.settings.get(key) == value for key, value in same.items())
            if is_same and frame in frames and not record.keyframe and record.model_revision in bodies:
                found.setdefault(frame, {})[i] = record.values
    return found


def test_poses_to_replace_are_those_of_a_simple_search(tmp_path, monkeypatch):
    rng, model = np.random.default_rng(7), load_model("gavrila22")
    people = [Person(name, m, "#53a504") for name, m in (("man", model), ("woman", load_model("gavrila22", 1.5)))]
    made = [TrackSettings(), replace(TrackSettings(), max_iterations=3)]
    with closing(AnnotationStore(tmp_path / "annotations.sqlite")) as store:
        bodies = [format_model(m) for m in (model, load_model("gavrila22", 1.7))]
        for person in people:
            revisions = [store.add_model_revision(person.name, text) for text in (format_model(person.model), *bodies)]
            changes = []
            for frame in range(60):
                record = {**settings_record(made[rng.integers(2)]), **({"more": 1} if rng.random() < 0.3 else {})}
                n = len(person.model.value_names)
                pose = PoseRecord(
                    rng.random(n), ("tracked",) * n, revisions[rng.integers(3)], rng.random() < 0.2,
                    settings=record if rng.random() < 0.9 else {},
                )  # fmt: skip
                changes.append(PoseChange(person.name, frame, pose if rng.random() < 0.9 else None))
            store.commit("track", changes)
        cases = [
            (frames, tracked, settings)
            for frames in (range(60), range(50, 4, -3), frozenset({3, 9, 40}), [59])
            for tracked in ((0,), (0, 1), ())
            for settings in made
        ]
        expected = [simple_poses_to_replace(store, people, *case) for case in cases]
        assert sum(map(len, expected)) > 50
        monkeypatch.setattr(store, "poses", None)  # it would read much that is not needed, under the page's lock
        for case, right in zip(cases, expected, strict=True):
            found = poses_to_replace(store, people, *case)
            assert found.keys() == right.keys()
            for frame, poses in right.items():
                assert found[frame].keys() == poses.keys()
                for i, values in poses.items():
                    np.testing.assert_array_equal(found[frame][i], values)


def test_stored_settings_name_their_method():
    for method in METHODS:
        assert make_tracker(METHODS[method].settings()).settings.method == method
    record = json.loads(json.dumps(settings_record(TrackSettings())))
    assert recorded_method(record) == record.pop("method") == "chamfer"
    assert recorded_method(record) == "chamfer"  # as former versions stored them
