"""Runs from stored poses: where they begin, what they save, and how they go on after an interruption."""

import json
import shutil
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tracker.errors import Remedy, SessionError, TrackerError
from tracker.formats.model_toml import format_model
from tracker.pipeline import methods
from tracker.pipeline.methods import METHODS, make_tracker
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.chamfer.method import CHAMFER
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import BackwardStep, PoseEstimate

STEP_M = 0.01
SETTINGS = TrackSettings(smooth=False, audit=False)


@dataclass
class Walker:
    """Stands for a tracker: walks along x; frame 3 is lost, and the backward pass finds it."""

    settings: TrackSettings

    def estimates(self, run):
        poses = [np.array(s[-1]) for s in run.start]
        for frame in run.frames:
            for i in run.subjects.tracked:
                poses[i] = run.subjects.keyframes_at(frame).get(i, poses[i] + STEP_M * (np.arange(len(poses[i])) == 0))
            yield self.estimate(frame, poses, "lost" if frame == 3 else "good")

    def evidence(self, observer, bodies):
        return None

    def backward_pass(self, run, tracked):
        (lost,) = (f for f in tracked if "lost" in f.statuses)
        yield BackwardStep(lost.frame, 0, 1, 2)
        better = self.estimate(lost.frame, [p + STEP_M for p in lost.poses], "good")
        yield BackwardStep(lost.frame, 0, 2, 2, (better,))

    def estimate(self, frame, poses, status):
        n = len(poses)
        return PoseEstimate(
            frame, tuple(poses), 1.0, np.ones(4), 0, (status,) * n, ("",) * n, (np.ones(10),) * n, (np.eye(22),) * n,
            (None,) * n, ((),) * n, "chamfer",
        )  # fmt: skip


@pytest.fixture
def session(tmp_path, sample_folder, monkeypatch):
    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=Walker))
    return load_session(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    """With a keyframe on the first frame."""
    store, (person,) = AnnotationStore(session.annotations_path), session.people
    values = person.model.neutral()
    record = PoseRecord(
        values, ("manual",) * len(values), store.add_model_revision(person.name, format_model(person.model)), True
    )
    store.commit("init", [PoseChange(person.name, 0, record)])
    yield store
    store.close()


def run_of(session, store, frames=range(6), settings=SETTINGS):
    return stored_run(session, store, None, TrackPlan(frames, (0,), settings))


def stored_x(store):
    return [float(store.pose("person", row.frame).values[0]) for row in store.frames("person")]


def track(run, n=None):
    """Take so many steps, or all."""
    for k, step in enumerate(run.steps(), start=1):
        run.take(step)
        if k == n:
            return


def test_a_run_is_one_entry_of_the_history_and_keeps_keyframes(session, store):
    with run_of(session, store) as run:
        track(run)
    assert run.finished
    assert (run.n_improved, run.next_frame, run.visited) == (1, None, 3)
    assert run.status_counts() == [{"good": 6}]
    rows = store.frames("person")
    assert [(r.frame, r.source) for r in rows] == [(0, "manual"), *((k, "tracked") for k in range(1, 6))]
    np.testing.assert_allclose(np.diff(stored_x(store)), STEP_M * np.array([1, 1, 2, 0, 1]))
    assert store.pose("person", 1).settings["method"] == "chamfer"
    assert store.undo() == "track frames 0:6"
    assert [r.frame for r in store.frames("person")] == [0]


def test_frames_are_saved_as_they_come(session, store, monkeypatch):
    monkeypatch.setattr("tracker.pipeline.stored_run._SAVE_FRAMES", 2)
    saved = []
    with run_of(session, store) as run:
        for estimate in run.first_pass():
            run.take(estimate)
            saved.append(len(store.frames("person")))
    assert saved == [1, 2, 2, 4, 4, 6]


@pytest.mark.parametrize("n", [2, 6, 7])
def test_the_same_task_goes_on_where_it_was_interrupted(session, store, n):
    """In the first pass, between the passes, and in the second."""
    with run_of(session, store) as run:
        track(run, n)
    assert len(store.frames("person")) == min(n, 6)
    with run_of(session, store) as run:
        assert list(run.frames) == list(range(n, 6))
        assert list(run.tracked) == list(range(min(n, 6)))
        track(run)
    np.testing.assert_allclose(np.diff(stored_x(store)), STEP_M * np.array([1, 1, 2, 0, 1]))
    with run_of(session, store) as run:  # once done, it begins again
        assert list(run.frames) == list(range(6))


@pytest.mark.parametrize(("frames", "settings"), [(range(5), SETTINGS), (range(6), replace(SETTINGS, trust_rad=0.2))])
def test_another_task_begins_at_its_first_frame(session, store, frames, settings):
    with run_of(session, store) as run:
        track(run, 2)
    with run_of(session, store, frames, settings) as run:
        assert run.frames == list(frames)
        assert not run.tracked


def test_what_a_former_version_interrupted_goes_on_or_begins_again(session, store):
    """Settings of the same values go on, also without their method; of other names they begin at the first frame."""
    with run_of(session, store) as run:
        track(run, 2)
    key = "unfinished track"
    unfinished = json.loads(json.dumps(store.setting(key)))
    settings = unfinished["task"][-1]
    assert settings.pop("method") == "chamfer"
    settings["second_pass"] = settings.pop("backward_pass")  # as it was called before
    store.set_setting(key, unfinished)
    with run_of(session, store) as run:
        assert list(run.frames) == [2, 3, 4, 5]
    for names in ("former", "recover"):
        unfinished["task"][-1][names] = {"a_former_name": 1.0}
        store.set_setting(key, unfinished)
        with run_of(session, store) as run:
            assert list(run.frames) == list(range(6))


def test_a_cleared_frame_ends_what_the_backward_pass_may_use(session, store):
    with run_of(session, store) as run:
        track(run, 5)
    store.commit("clear", [PoseChange("person", 2, None)])
    with run_of(session, store) as run:
        assert list(run.tracked) == [3, 4]


def test_without_a_pose_there_is_nothing_to_begin_from(session, store):
    store.undo()
    with pytest.raises(SessionError, match="expected a pose") as caught, run_of(session, store, range(2, 6)):
        pass
    assert caught.value.remedy == Remedy("place_body")


def test_an_unknown_method_is_refused():
    @dataclass(frozen=True)
    class Settings:
        method = "sonar"

    with pytest.raises(TrackerError, match=f"among {', '.join(methods.METHODS)}, found 'sonar'"):
        make_tracker(Settings())
