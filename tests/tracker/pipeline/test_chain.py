"""The chain from footage to tracked poses: its stages and sentences, its start, and how it goes on after a stop."""

import re
import shutil
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_tracker import Walker

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.fitting.hypothesis import Hypothesis
from tracker.formats.model_toml import format_model
from tracker.initialization.first_pose import FirstPose, FirstPoses
from tracker.pipeline import chain
from tracker.pipeline.chain import StoredSession, run_chain, start_frame
from tracker.pipeline.find_people import FindSettings, FoundPeople
from tracker.pipeline.methods import METHODS
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.chamfer.method import CHAMFER
from tracker.tracking.chamfer.settings import TrackSettings

FRAME = 3


class StoppedError(Exception):
    """The user stops."""


class Notes:
    """A sink that keeps what it receives, and stops the chain at a step of the run."""

    def __init__(self, stop_at=None):
        self.said, self.steps, self._stop_at = [], [], stop_at

    def report(self, stage, share, text=""):
        self.said += [text] if text else []

    def show(self, frame, found):
        self.said.append(f"tried {frame}")

    def take(self, run, step):
        self.steps.append(step)
        if len(self.steps) == self._stop_at:
            raise StoppedError


@pytest.fixture
def found(monkeypatch):
    """Stands for the search; counts how often it is done."""
    calls = []

    def find(session, observer, people, frames, settings, report, show):
        calls.append(people)
        model = session.people[0].model
        start = Hypothesis(PosedBody(model, model.neutral()), "voxels")
        first = FirstPose(FRAME, start, "good", 1.5, True, ("left arm unresolved",))
        show(FRAME, None)
        return FoundPeople(FirstPoses(FRAME, {0: first}), {0: model}, {0: model.neutral()}, {})

    monkeypatch.setattr(chain, "find_people", find)
    return calls


@pytest.fixture
def walkers(monkeypatch):
    """The trackers that were made; each walks a centimetre a frame along x."""
    made = []

    def make(settings):
        made.append(Walker(settings))
        return made[-1]

    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=make))
    return made


@pytest.fixture
def opened(tmp_path, sample_folder):
    session = load_session(shutil.copytree(sample_folder, tmp_path / "session"))
    session.annotations_path.unlink(missing_ok=True)
    observer = SimpleNamespace(cameras=session.cameras, with_cameras=lambda chosen: None)
    with closing(AnnotationStore(session.annotations_path)) as store:
        yield StoredSession(session, store, observer)


def run(opened, sink=None, frames=range(6), smooth=False):
    plan = TrackPlan(frames, (0,), TrackSettings(smooth=smooth))
    return run_chain(plan, FindSettings(), opened, sink or Notes())


def rows(opened):
    with closing(AnnotationStore(opened.session.annotations_path, read_only=True)) as store:
        return {row.frame: store.pose("person", row.frame) for row in store.frames("person")}


def test_it_tracks_out_from_the_start_in_both_directions_and_keeps_the_start(opened, found, walkers):
    sink = Notes()
    assert run(opened, sink).start == FRAME
    (walker,) = walkers
    assert walker.asked == [[3, 2, 1, 0], [3, 4, 5]]
    assert [s.frame for s in sink.steps] == [2, 1, 0, 4, 5]
    assert sink.said[0] == "tried 3"
    assert re.search(r"person: started on frame 3 by voxels.* good, cost 1.50 px", sink.said[1])
    assert sink.said[2:] == ["person: left arm unresolved", "tracking from frame 3 to 0, and to 5"]
    poses = rows(opened)
    assert [poses[k].sources[0] for k in range(6)] == ["tracked"] * 3 + ["searched"] + ["tracked"] * 2
    start = poses[FRAME].values[0]
    np.testing.assert_allclose([poses[k].values[0] - start for k in range(6)], 0.01 * np.array([4, 3, 2, 0, 2, 3]))


def test_smoothing_joins_both_directions_and_keeps_the_start(opened, found, walkers):
    run(opened, smooth=True)
    assert opened.run.finished
    poses = rows(opened)
    np.testing.assert_array_equal(poses[FRAME].values, opened.session.people[0].model.neutral())
    assert poses[FRAME].sources[0] == "searched"
    assert all(poses[k].settings["smooth"] for k in (0, 1, 2, 4, 5))


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3, 4])
def test_a_stopped_chain_goes_on_where_it_was(opened, found, walkers, n):
    """In the first leg, between the legs, and in the second."""
    with pytest.raises(StoppedError):
        run(opened, Notes(stop_at=n))
    before, sink = rows(opened), Notes()
    assert len(before) == n + 1
    run(opened, sink)
    assert len(found) == 1
    assert len(sink.steps) == 5 - n
    after = rows(opened)
    assert sorted(after) == list(range(6))
    assert all(np.array_equal(after[k].values, before[k].values) for k in before)
    run(opened, sink := Notes())  # once done, it begins again, at the same start
    assert len(sink.steps) == 5
    assert sink.said == ["tracking from frame 3 to 0, and to 5"]


def test_the_first_frame_needs_no_way_back(opened, found, walkers):
    run(opened, frames=range(FRAME, 6))
    assert walkers[0].asked == [[3, 4, 5]]


def test_a_single_frame_needs_no_run(opened, found, walkers):
    run(opened, frames=range(FRAME, FRAME + 1))
    assert walkers[0].asked == []
    assert list(rows(opened)) == [FRAME]


def test_it_starts_where_people_were_put_rather_than_where_they_were_tracked():
    put, followed = {7: "manual", 2: "tracked", 3: "tracked"}, {7: "tracked", 2: "tracked", 3: "searched"}
    assert start_frame([put], range(10)) == 7
    assert start_frame([put, followed], range(10)) == 3
    assert start_frame([put, followed], range(5)) == 3
    assert start_frame([{2: "tracked", 3: "tracked"}], range(10)) == 2


def test_people_placed_on_different_frames_alone_are_refused(opened, found):
    person = opened.session.people[0]
    values = person.model.neutral()
    with closing(AnnotationStore(opened.session.annotations_path)) as store:
        revision = store.add_model_revision(person.name, format_model(person.model))
        record = PoseRecord(values, ("manual",) * len(values), revision)
        store.commit("put", [PoseChange("person", 9, record)])
    with pytest.raises(TrackerError, match="a frame on which all people have a pose"):
        run(opened)
    assert found == []
