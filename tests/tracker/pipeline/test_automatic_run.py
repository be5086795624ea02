"""The chain from footage to tracked poses: its stages and sentences, its start, and how it goes on after a stop."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_tracker import Walker
from run_poses import Estimate
from stored_motions import store_poses

from tracker.body.dimensions import dimensions_of, with_dimensions
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.estimation.chamfer.method import CHAMFER
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.initialization.first_pose import FirstPose, FirstPoses
from tracker.estimation.initialization.frame_trials import Trying
from tracker.formats.model_toml import format_model, load_model
from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.pipeline import automatic_run, track_session
from tracker.pipeline.automatic_run import ChainPlan, StoredSession, find_and_track, start_frame
from tracker.pipeline.calibration_revisions import change_calibration, with_corrections
from tracker.pipeline.find_people import FindSettings
from tracker.pipeline.methods import METHODS
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import load_session, save_model
from tracker.session.store.annotation_store import AnnotationStore

FRAME = 3


class StoppedError(Exception):
    """The user stops."""


class Notes:
    """A sink that keeps what it receives, and stops the chain at a step of the run."""

    def __init__(self, stop_at=None):
        self.said, self.steps, self._stop_at = [], [], stop_at

    def report(self, stage, share, text=""):
        self.said += [text] if text else []

    def show(self, trying):
        self.said.append(f"tried {trying.frame}")

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
        start = Hypothesis(PosedBody(model, model.neutral()), "voxels", is_measured=True)
        first = FirstPose(FRAME, start, "good", 1.5, True, ("left arm unresolved",))
        show(Trying(FRAME, 1, 2, "", None, None, None))
        return FirstPoses(FRAME, {0: first})

    monkeypatch.setattr(automatic_run, "find_people", find)
    return calls


@pytest.fixture
def walkers(monkeypatch):
    """The trackers that were made; each walks a centimetre a frame along x."""
    made = []

    def make(settings):
        made.append(Walker(settings))
        return made[-1]

    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=make))
    monkeypatch.setattr(track_session.TrackSession, "_scored", lambda run, found: found)  # there is no evidence
    return made


@pytest.fixture
def opened(tmp_path, sample_folder):
    session = load_session(shutil.copytree(sample_folder, tmp_path / "session"))
    session.annotations_path.unlink(missing_ok=True)
    observer = SimpleNamespace(cameras=session.cameras, with_cameras=lambda chosen: None)
    with AnnotationStore(session.annotations_path) as store:
        yield StoredSession(session, store, observer)


def run(opened, sink=None, frames=range(6), whole_run=False, acquire=(), is_finding=True):
    plan = TrackPlan(frames, (0,), TrackSettings(whole_run=whole_run))
    return find_and_track(ChainPlan(plan, FindSettings() if is_finding else None, acquire), opened, sink or Notes())


@pytest.fixture
def acquiring(opened, monkeypatch):
    """Stands for the acquisition, which finds a thinner forearm; keeps the poses that it was given. The person's body
    has the sizes of its preset and the height of the sample."""
    asked = SimpleNamespace(calls=[], cost_px=1.0)
    height_m = opened.session.people[0].model.height_m
    opened.session = save_model(opened.session, 0, load_model("gavrila22").with_height(height_m))

    def acquire(session, observer, person, frames, settings, report, known, joints):
        asked.calls.append(known)
        report("fitting", 0.5)
        before = session.people[person].model
        sizes = dimensions_of(before)
        arm = sizes.parts["left_forearm"]
        thin = {**sizes.parts, "left_forearm": arm._replace(girths_m=(0.5 * arm.girths_m[0], arm.girths_m[1]))}
        body = with_dimensions(before, sizes._replace(height_m=1.1 * before.height_m, parts=thin))
        return Acquisition(body, (FRAME,), (body.neutral() + 0.01,), 2.0, asked.cost_px, None, None)

    monkeypatch.setattr(automatic_run, "acquire_body", acquire)
    return asked


def put(opened, frame, keyframe=False):
    """Place the person by hand."""
    (person,) = opened.session.people
    store_poses(opened.session, {frame: person.model.neutral()}, keyframe=keyframe)


def rows(opened):
    with AnnotationStore(opened.session.annotations_path, read_only=True) as store:
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


def test_a_start_that_was_found_is_estimated_with_the_others_and_begins_the_next_run(
    opened, found, walkers, monkeypatch
):
    monkeypatch.setattr(track_session, "estimate_run", Estimate(0.1))
    run(opened, whole_run=True)
    assert opened.run.finished
    assert walkers[0].asked == [[3, 2, 1, 0], [3, 4, 5], [0, 1, 2, 3], [5, 4, 3]]
    poses, start = rows(opened), opened.session.people[0].model.neutral()
    assert [poses[k].values[1] for k in range(6)] == pytest.approx([start[1] + 0.1] * 6)
    assert poses[FRAME].sources[0] == "searched"
    assert all(poses[k].settings["whole_run"] for k in (0, 1, 2, 4, 5))
    assert run(opened, whole_run=True).start == FRAME
    assert len(found) == 1


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_a_stopped_chain_goes_on_at_its_block(opened, found, walkers, blocks, n):
    """In the first leg, before its last frame, between the legs, and in the second."""
    with pytest.raises(StoppedError):
        run(opened, Notes(stop_at=n))
    before, sink = rows(opened), Notes()
    assert len(before) == n + 1
    run(opened, sink)
    assert len(found) == 1
    assert len(sink.steps) == {1: 4, 2: 4, 3: 2, 4: 1}[n]
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
    with pytest.raises(TrackerError, match="expected a frame of 0 to 1 on which all people have a pose, found frame 2"):
        start_frame([put, followed], range(2))


def test_people_placed_beyond_the_frames_alone_are_refused(opened, found):
    put(opened, 9)
    with pytest.raises(TrackerError, match="a frame of 0 to 5 on which all people have a pose, found frame 9"):
        run(opened)
    assert found == []


def test_sizes_are_acquired_and_stored_before_tracking(opened, found, walkers, acquiring):
    before = opened.session.people[0].model
    run(opened, sink := Notes(), acquire=(0,))
    (known,) = acquiring.calls
    assert list(known.bodies) == [FRAME]
    assert known.has_measured_height
    body = opened.session.people[0].model
    assert body.height_m == pytest.approx(1.1 * before.height_m)
    assert format_model(load_session(opened.session.folder).people[0].model) == format_model(body)
    assert "sizes from frames 3: 1.96 m tall, cost 2.00 px before, 1.00 px after" in " ".join(sink.said)
    poses = rows(opened)
    assert len({poses[k].model_revision for k in range(6)}) == 1
    start = poses[FRAME]
    assert (start.sources[0], start.status, start.settings["method"]) == ("searched", "good", "voxels")
    np.testing.assert_allclose(start.values, retarget_pose(before.neutral(), before, body), atol=1e-6)
    with AnnotationStore(opened.session.annotations_path, read_only=True) as store:
        assert [e.label for e in store.history()] == [
            "track frames 0:6", "acquire sizes of person", "find people, frame 3"
        ]  # fmt: skip


@pytest.mark.parametrize("cost_px", [1.0, 2.0])
def test_a_chain_stopped_while_tracking_goes_on_in_the_same_body(opened, found, walkers, acquiring, blocks, cost_px):
    """Also in that of the preset, where the acquired one was no better."""
    acquiring.cost_px = cost_px
    with pytest.raises(StoppedError):
        run(opened, Notes(stop_at=2), acquire=(0,))
    body = opened.session.people[0].model
    run(opened, sink := Notes(), acquire=(0,))
    assert len(acquiring.calls) == len(found) == 1
    assert len(sink.steps) == 4
    assert opened.session.people[0].model is body


def test_a_chain_stopped_while_sizes_are_acquired_goes_on_there(opened, found, walkers, acquiring):
    class Impatient(Notes):
        def report(self, stage, share, text=""):
            if stage == "acquiring sizes":
                raise StoppedError

    before = opened.session.people[0].model
    with pytest.raises(StoppedError):
        run(opened, Impatient(), acquire=(0,))
    assert list(rows(opened)) == [FRAME]
    assert opened.session.people[0].model.height_m == before.height_m
    run(opened, acquire=(0,))
    assert (len(found), len(acquiring.calls)) == (1, 2)
    assert sorted(rows(opened)) == list(range(6))


def test_sizes_are_acquired_of_placed_people_unless_they_have_their_own(opened, found, walkers, acquiring):
    put(opened, 4, keyframe=True)
    assert run(opened, acquire=(0,), is_finding=False).start == 4
    assert found == []
    poses = rows(opened)
    body = opened.session.people[0].model
    preset = load_model("gavrila22")
    put_m = preset.with_height(1.78).points_world(preset.neutral())
    np.testing.assert_allclose(body.points_world(poses[4].values), put_m, atol=0.15)
    assert poses[4].settings["method"] == "refit"
    assert sorted(poses) == list(range(6))
    run(opened, acquire=(0,), is_finding=False)
    assert len(acquiring.calls) == 1


def test_sizes_of_an_earlier_calibration_are_acquired_again(opened, found, walkers, acquiring):
    put(opened, 4, keyframe=True)
    run(opened, acquire=(0,), is_finding=False)
    corrections = np.zeros((len(opened.session.cameras), N_CORRECTIONS))
    corrections[0, 1] = 0.01
    changed = with_corrections(opened.session, corrections)
    with AnnotationStore(opened.session.annotations_path) as store:
        opened.session = change_calibration(opened.session, store, changed, "corrected")
        assert opened.outdated_sizes() == ["person"]
        store.undo()
        assert opened.outdated_sizes() == []
        store.redo()
    run(opened, acquire=(0,), is_finding=False)
    assert len(acquiring.calls) == 2
    assert opened.outdated_sizes() == []
    run(opened, acquire=(0,), is_finding=False)
    assert len(acquiring.calls) == 2


def test_people_without_a_pose_are_named_where_nobody_is_looked_for(opened, found, acquiring):
    with pytest.raises(TrackerError, match="expected a pose of 'person', found none") as error:
        run(opened, acquire=(0,), is_finding=False)
    assert error.value.remedy.code == "find_or_place"
    assert found == acquiring.calls == []
