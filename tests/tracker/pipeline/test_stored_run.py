"""Runs from stored poses: where they begin, what they propose and save, and how they go on after an interruption."""

import json
import shutil
from dataclasses import dataclass, replace

import numpy as np
import pytest
from run_poses import MOVED, Estimate
from stored_motions import put_poses

from tracker.errors import Remedy, SessionError, TrackerError
from tracker.estimation.chamfer.method import CHAMFER
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import AlternativePose, BackwardStep, PoseEstimate
from tracker.pipeline import methods, track_session
from tracker.pipeline.methods import METHODS, make_tracker
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.pipeline.track_session import EstimatedRows, EstimateStep
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

STEP_M, MOVED_M = 0.01, 0.1
N = 6
FIRST_PASS = TrackSettings(whole_run=False)
SETTINGS = TrackSettings()


@dataclass
class Walker:
    """Stands for a tracker: walks along x; frame 3 is lost, and has an alternative."""

    settings: TrackSettings

    def estimates(self, run):
        poses = [np.array(s[-1]) for s in run.start]
        for frame in run.frames:
            for i in run.subjects.tracked:
                poses[i] = run.subjects.keyframes_at(frame).get(i, poses[i] + STEP_M * (np.arange(len(poses[i])) == 0))
            n, others = len(poses), (AlternativePose(poses[0] + 0.5, 2.0),) if frame == 3 else ()
            yield PoseEstimate(
                frame, tuple(poses), 1.0, np.ones(4), 0, ("lost" if frame == 3 else "good",) * n, ("",) * n,
                (np.ones(10),) * n, (np.eye(22),) * n, (None,) * n, (others,) * n, "chamfer",
            )  # fmt: skip


@pytest.fixture
def session(tmp_path, sample_folder, monkeypatch):
    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=Walker))
    monkeypatch.setattr(track_session.TrackSession, "_scored", lambda run, found: found)  # there is no evidence
    return load_session(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    """With a keyframe on the first frame."""
    store = AnnotationStore(session.annotations_path)
    put(session, store, 0)
    yield store
    store.close()


@pytest.fixture
def estimate(monkeypatch):
    """Stands for the estimate: all poses move along y, frame 2 by another path."""
    held_estimate = Estimate(MOVED_M, {2: {"entry": MOVED}})
    monkeypatch.setattr(track_session, "estimate_run", held_estimate)
    return held_estimate


def put(session, store, frame, x_m=0.0, source="manual", keyframe=True, index=0):
    person = session.people[index]
    values = person.model.neutral() + x_m * (np.arange(len(person.model.neutral())) == 0)
    put_poses(store, person, {frame: values}, source, keyframe=keyframe)


def run_of(session, store, frames=range(N), settings=FIRST_PASS, start=None):
    return stored_run(session, store, None, TrackPlan(frames, (0,), settings, start=start))


def stored(store, axis):
    return [float(store.pose("person", row.frame).values[axis]) for row in store.frames("person")]


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
    assert (run.n_moved, run.next_frame, run.visited) == (0, None, None)
    assert run.status_counts() == [{"good": 5, "lost": 1}]
    rows = store.frames("person")
    assert [(r.frame, r.source) for r in rows] == [(0, "manual"), *((k, "tracked") for k in range(1, N))]
    np.testing.assert_allclose(np.diff(stored(store, 0)), STEP_M)
    assert store.pose("person", 1).settings["method"] == "chamfer"
    assert store.undo() == "track frames 0:6"
    assert [r.frame for r in store.frames("person")] == [0]


def test_the_poses_just_before_a_run_show_the_motion_there_and_stay(session, store, estimate):
    for k, keyframe in ((2, False), (3, True)):
        put(session, store, k, STEP_M * k, keyframe=keyframe)
    before = stored(store, 1)
    with run_of(session, store, range(4, 4 + N), SETTINGS) as run:
        track(run)
    (asked,) = estimate.asked
    assert (sorted(asked.around), sorted(asked.poses)) == ([2, 3], [*range(4, 4 + N)])
    assert asked.around[3][0][0] == pytest.approx(3 * STEP_M)
    assert stored(store, 1)[: len(before)] == before
    assert run.costs_px == dict.fromkeys(range(4, 4 + N), 1.5)  # of the estimated poses


def test_the_estimate_takes_the_place_of_the_poses_of_the_first_pass(session, store, estimate):
    before = store.pose("person", 0)
    with run_of(session, store, settings=SETTINGS) as run:
        track(run)
    assert (run.finished, run.n_moved, run.visited) == (True, 1, 0)
    assert run.status_counts() == [{"good": N}]
    assert stored(store, 1) == pytest.approx([0.0, *[MOVED_M] * (N - 1)])
    assert [run.tracked[k].poses[0][1] for k in range(N)] == pytest.approx(stored(store, 1))
    np.testing.assert_allclose(np.diff(stored(store, 0)), STEP_M)
    records = store.poses("person", range(N))
    assert [records[k].trace for k in (1, 2)] == [(), (MOVED,)]
    assert (records[1].cost_px, records[1].view_costs_px, records[1].status) == (1.5, (0.5,) * 4, "good")
    assert records[1].errors is not None
    keyframe = records[0]
    assert (keyframe.status, keyframe.values.tobytes(), keyframe.keyframe) == ("good", before.values.tobytes(), True)
    assert (keyframe.sources, keyframe.author, keyframe.time) == (before.sources, before.author, before.time)
    assert store.undo() == "track frames 0:6"
    assert [r.frame for r in store.frames("person")] == [0]
    assert store.pose("person", 0).status == ""


def test_the_estimate_is_asked_with_all_that_was_proposed(session, store, estimate):
    """Stored poses of an earlier run propose nothing: the result does not depend on them."""
    for _ in range(2):
        with run_of(session, store, settings=SETTINGS) as run:
            track(run)
    for asked in estimate.asked:
        assert sorted(asked.poses) == list(range(N))
        assert [asked.poses[k][0][0] for k in range(N)] == pytest.approx(STEP_M * np.arange(N))
        assert (asked.fps, asked.settings, asked.stays) == (session.fps, SETTINGS, False)
        assert sorted(asked.subjects.keyframes) == [0]
        sources = {k: [p.source for p in asked.proposals[k, 0]] for k in range(N)}
        assert sources == {k: ["backward", *["alternative"] * 2 * (k == 3)] for k in range(N)}  # those of either pass
        back = {k: next(p.pose[0] for p in asked.proposals[k, 0] if p.source == "backward") for k in range(N)}
        assert [back[k] for k in range(1, N)] == pytest.approx([STEP_M * (N - 1 + N - k) for k in range(1, N)])
        assert back[0] == 0.0


def test_a_start_that_was_found_is_estimated_and_stays_the_start(session, store, estimate):
    store.undo()
    put(session, store, 3, 0.2, "searched", keyframe=False)
    with run_of(session, store, settings=SETTINGS, start=3) as run:
        track(run)
    (asked,) = estimate.asked
    assert not asked.subjects.keyframes
    assert asked.poses[3][0][0] == pytest.approx(0.2)
    assert [p.source for p in asked.proposals[3, 0]].count("backward") == 2  # by either leg
    assert stored(store, 1) == pytest.approx([MOVED_M] * N)
    sources = [store.pose("person", k).sources[0] for k in range(N)]
    assert sources == [*["tracked"] * 3, "searched", *["tracked"] * 2]


def test_a_start_that_is_a_keyframe_stays(session, store, estimate):
    put(session, store, 3)
    before = store.pose("person", 3)
    with run_of(session, store, settings=SETTINGS, start=3) as run:
        track(run)
    after = store.pose("person", 3)
    assert after.values.tobytes() == before.values.tobytes()
    assert (after.sources, after.keyframe, after.status) == (before.sources, True, "good")
    assert stored(store, 1) == pytest.approx([0.0, MOVED_M, MOVED_M, 0.0, MOVED_M, MOVED_M])


def test_the_status_of_the_estimate_counts(session, store, estimate):
    lost = np.array([0.9, 0.0, 0.0, 0.0])
    estimate.known = {0: {"elsewhere": lost}, 4: {"elsewhere": lost}}
    with run_of(session, store, settings=SETTINGS) as run:
        track(run)
    assert run.status_counts() == [{"good": N - 2, "lost": 2}]
    assert [r.status for r in store.poses("person", range(N)).values()] == ["lost", *["good"] * 3, "lost", "good"]
    assert store.pose("person", 0).remark == "left arm uncertain: elsewhere on 90% of the likely paths"


def test_each_person_gets_their_own_rows(session, store, estimate):
    """Also where one of them alone is tracked; the other stays."""
    (person,) = session.people
    pair = replace(session, people=(person, replace(person, name="beside")))
    put(pair, store, 0, 3.0, index=1)
    put(pair, store, 5, 4.0, index=1)
    for people, moved in (((1,), {"beside"}), ((0, 1), {"person", "beside"})):
        with stored_run(pair, store, None, TrackPlan(range(4), people, SETTINGS)) as run:
            track(run)
        assert {name: [store.pose(name, k).values[1] for k in range(4) if store.pose(name, k)] for name in moved} == {
            name: [0.0, *[pytest.approx(MOVED_M)] * 3] for name in moved
        }
        assert [store.pose("beside", k).values[0] for k in range(4)] == pytest.approx([3.0, 3.01, 3.02, 3.03])
        assert len(store.frames("person")) == (4 if 0 in people else 1)
    assert [i for asked in estimate.asked for i in asked.subjects.tracked] == [1, 0, 1]
    assert store.pose("person", 3).values[0] == pytest.approx(0.03)
    assert store.pose("beside", 5).values[0] == 4.0


def test_frames_are_saved_as_they_come(session, store, monkeypatch):
    monkeypatch.setattr("tracker.pipeline.stored_run._SAVE_FRAMES", 2)
    saved = []
    with run_of(session, store) as run:
        for step in run.first_pass():
            run.take(step)
            saved.append(len(store.frames("person")))
    assert saved == [1, 2, 2, 4, 4, 6]


@pytest.mark.parametrize("n", [2, 3, N, N + 1, 2 * N, 2 * N + 3, 3 * N])
@pytest.mark.parametrize("start", [None, 3])
def test_the_same_task_goes_on_at_the_block_that_was_interrupted(session, store, estimate, blocks, n, start):
    """In the first pass, between the passes, in the second, and in the estimate of all poses."""
    if start is not None:
        put(session, store, start, 0.2, "searched", keyframe=False)
        store.set_setting("locked", {"person": ["torso.z"]})

    def records():
        return [
            (r.values.tobytes(), r.status, r.sources, r.trace, r.settings)
            for r in store.poses("person", range(N)).values()
        ]

    with run_of(session, store, settings=SETTINGS, start=start) as run:
        track(run)
    whole, asked = records(), estimate.asked.pop()
    store.undo()
    n_first, kinds = N - (start is not None), []
    with run_of(session, store, settings=SETTINGS, start=start) as run:
        for step in run.steps():
            kinds.append(type(step))
            if len(kinds) <= n and not isinstance(step, EstimatedRows):
                run.take(step)
            else:
                break
    assert not run.finished
    assert stored(store, 1)[1:] == [0.0] * (len(stored(store, 1)) - 1)  # no part of the estimate
    estimate.asked.clear()
    with run_of(session, store, settings=SETTINGS, start=start) as run:
        assert len(run.frames) == {2: 4, 3: 4 if start is None else 2}.get(n, 0)
        track(run)
    assert records() == whole
    again = estimate.asked.pop()
    assert again.proposals.keys() == asked.proposals.keys()
    for at, own in asked.proposals.items():
        assert {p.pose.tobytes() for p in again.proposals[at]} == {p.pose.tobytes() for p in own}
    with run_of(session, store, settings=SETTINGS, start=start) as run:  # once done, it begins again
        assert len(run.frames) == n_first


def test_the_steps_of_a_run_come_in_order(session, store, estimate):
    with run_of(session, store, settings=SETTINGS) as run:
        steps = []
        for step in run.steps():
            run.take(step)
            steps.append(step)
    assert [type(s) for s in steps] == [*[PoseEstimate] * N, *[BackwardStep] * N, *[EstimateStep] * N, EstimatedRows]
    assert [s.frame for s in steps[:N]] == list(range(N))
    assert [(s.found.frame, s.done, s.total) for s in steps[N : 2 * N]] == [(N - 1 - k, k + 1, N) for k in range(N)]


@pytest.mark.parametrize(
    ("frames", "settings"), [(range(5), FIRST_PASS), (range(N), replace(FIRST_PASS, trust_rad=0.2))]
)
def test_another_task_begins_at_its_first_frame(session, store, frames, settings):
    with run_of(session, store) as run:
        track(run, 2)
    with run_of(session, store, frames, settings) as run:
        assert run.frames == list(frames)
        assert not run.tracked


def test_an_interrupted_run_of_a_former_version_goes_on_or_restarts(session, store, blocks):
    """Settings of the same values go on, also without their method; of other names they begin at the first frame."""
    with run_of(session, store) as run:
        track(run, 2)
    key = "unfinished track"
    unfinished = json.loads(json.dumps(store.setting(key)))
    settings = unfinished["task"][-1]
    assert settings.pop("method") == "chamfer"
    store.set_setting(key, unfinished)
    with run_of(session, store) as run:
        assert list(run.frames) == [2, 3, 4, 5]
    for names in ("former", "recover"):
        unfinished["task"][-1][names] = {"a_former_name": 1.0}
        store.set_setting(key, unfinished)
        with run_of(session, store) as run:
            assert list(run.frames) == list(range(N))


def test_a_cleared_frame_is_tracked_again_with_its_block(session, store, blocks):
    with run_of(session, store) as run:
        track(run, 5)
    store.commit("clear", [PoseChange("person", 3, None)])
    with run_of(session, store) as run:
        assert (list(run.tracked), run.frames) == ([0, 1], [2, 3, 4, 5])


def test_a_block_begins_at_the_poses_before_it(session, store, blocks):
    with run_of(session, store) as run:
        begun, estimates = [], run.tracker.estimates
        run.tracker.estimates = lambda block: begun.append(block) or estimates(block)
        track(run)
    assert [(b.frames, len(b.start[0])) for b in begun] == [(range(2), 1), (range(2, 4), 2), (range(4, 6), 4)]
    assert [p[0] for p in begun[1].start[0]] == pytest.approx([0.0, STEP_M])


def test_without_a_pose_there_is_nothing_to_begin_from(session, store):
    store.undo()
    with pytest.raises(SessionError, match="expected a pose") as caught, run_of(session, store, range(2, N)):
        pass
    assert caught.value.remedy == Remedy("place_body")


def test_an_unknown_method_is_refused():
    @dataclass(frozen=True)
    class Settings:
        method = "sonar"

    with pytest.raises(TrackerError, match=f"among {', '.join(methods.METHODS)}, found 'sonar'"):
        make_tracker(Settings())
