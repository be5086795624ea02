"""The audit at the end of a run: the consensus of tracks without a view each, errors of joints, and statuses."""

import shutil
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from tracker.fitting.consensus import agreement
from tracker.pipeline.run_repair import RepairedPose, RepairStep, RunRepair
from tracker.tracking.view_tracks import FrameTracks

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.body.searches import Search
from tracker.fitting.hypothesis import Hypothesis
from tracker.formats.model_toml import format_model, load_model
from tracker.pipeline import track_session
from tracker.pipeline.assessed_poses import assessed_by_tracks, assessed_keyframe, with_alternatives, with_repair
from tracker.pipeline.methods import METHODS
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.pipeline.track_session import AuditStep
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import Alternative, PoseChange, PoseRecord
from tracker.tracking.chamfer.method import CHAMFER
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.confidence import LimbFeatures, PoseQuality
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.person_memory import HISTORY_FRAMES

N, WRONG, APART = 10, 3, 4
OBSERVER = SimpleNamespace(ahead_frames=lambda frame: (0.0,))
SETTINGS = TrackSettings(smooth=False)
CLEAR = PoseQuality(
    0.05, 4, 0.0, 0.02,
    tuple(LimbFeatures(n, 1.0, 0.0, 1.2, 0.05, 0.6, 0.5, 0.0, 1.2, 0.06, 1.0, 1.0, 0.01) for n in "abcd"),
)  # fmt: skip


@dataclass
class Stands:
    """Stands for a tracker: the person stands still, but is half a metre aside on one frame."""

    settings: TrackSettings

    def estimates(self, run):
        for frame in run.frames:
            pose = np.array(run.subjects.models[0].neutral())
            pose[0] = 0.5 if frame == WRONG else 0.0
            pose = run.subjects.keyframes_at(frame).get(0, pose)
            n = run.subjects.models[0].n_dofs
            yield PoseEstimate(
                frame, (pose,), 1.0, np.ones(4), 0, ("good",), ("",), (np.ones(10),), (1e-4 * np.eye(n),), (CLEAR,),
                ((),), "chamfer",
            )  # fmt: skip

    def evidence(self, observer, bodies):
        return None

    def backward_pass(self, run, tracked):
        return iter(())


@pytest.fixture
def audited(monkeypatch):
    """The runs of the audit: frames and poses to begin with. The tracks agree, but on one frame.

    Their first frame has no history.
    """
    runs = []

    def tracks(tracker, run, known):
        runs.append((list(run.frames), [p[0] for p in run.start[0]], sorted(known)))
        for frame in run.frames:
            poses = np.array([run.subjects.models[0].neutral()] * 4)
            poses[:, 0] = [0.2, -0.2, 0.2, -0.2] if frame == APART else 0.0
            has_history = frame != run.frames[0]
            yield frame, {0: FrameTracks(poses, np.ones((4, 4)), ("FRONT", "RIGHT", "BACK", "LEFT"), has_history)}

    monkeypatch.setattr(track_session, "tracks_without_views", tracks)
    monkeypatch.setattr(RunRepair, "steps", lambda repair: iter(()))
    return runs


@pytest.fixture
def session(tmp_path, sample_folder, monkeypatch):
    monkeypatch.setitem(METHODS, "chamfer", replace(CHAMFER, make_tracker=Stands))
    return load_session(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    """With a keyframe on frame 0."""
    store, (person,) = AnnotationStore(session.annotations_path), session.people
    revision, values = store.add_model_revision(person.name, format_model(person.model)), person.model.neutral()
    keyframe = PoseRecord(values, ("manual",) * len(values), revision, True)
    store.commit("init", [PoseChange(person.name, 0, keyframe)])
    yield store
    store.close()


def track(session, store, settings=SETTINGS, stop=lambda step: False):
    with stored_run(session, store, OBSERVER, TrackPlan(range(N), (0,), settings)) as run:
        for step in run.steps():
            run.take(step)
            if stop(step):
                break
    return run


def records(store):
    return [store.pose("person", k) for k in range(N)]


def test_the_consensus_is_stored_with_its_errors_and_status(session, store, audited):
    run = track(session, store)
    assert audited == [([*range(N)], [0.0, 0.0], [*range(N)])]
    found = records(store)
    assert found[WRONG].values[0] == pytest.approx(0.0, abs=0.001)  # outvoted
    assert [r.status for r in found] == ["", *["good"] * 3, "lost", *["good"] * 5]
    assert found[APART].remark == "left arm uncertain without FRONT"
    sigmas = [np.sqrt(np.trace(r.errors, axis1=1, axis2=2)).max() for r in found[1:]]
    assert sigmas[APART - 1] == pytest.approx(0.2, rel=0.02)
    assert max(s for k, s in enumerate(sigmas, start=1) if k != APART) < 0.03
    assert found[0].keyframe
    assert found[0].values[0] == 0.0
    assert run.status_counts()[0]["lost"] == 1
    assert store.undo() == f"track frames 0:{N}"


@pytest.fixture
def keyframe(session, store):
    """A keyframe, the person half a metre aside of all tracks, by somebody."""
    first = store.pose("person", 0)
    values = np.array(first.values)
    values[0] = 0.5
    record = replace(first, values=values, remark="by hand")
    store.commit("drag", [PoseChange("person", WRONG, record)], author="eve")
    return store.pose("person", WRONG)


def test_a_keyframe_is_assessed_by_tracks_and_stays(session, store, audited, keyframe):
    run = track(session, store)
    found = store.pose("person", WRONG)
    assert (found.status, found.remark) == ("lost", "left arm uncertain without FRONT")
    assert len(found.limbs_lost) == 4
    assert np.sqrt(np.trace(found.errors, axis1=1, axis2=2)).min() == pytest.approx(0.5, rel=0.05)
    np.testing.assert_array_equal(found.values, keyframe.values)
    for name in ("keyframe", "sources", "settings", "author", "time", "model_revision", "reviewed", "cost_px"):
        assert getattr(found, name) == getattr(keyframe, name), name
    assert run.status_counts()[0]["lost"] == 2
    row = next(r for r in store.frames("person") if r.frame == WRONG)
    assert (row.assessed_since, row.keyframe) == (True, True)
    store.undo()  # the run and its assessment
    again = store.pose("person", WRONG)
    assert (again.status, again.remark, again.errors) == ("", "by hand", None)


def test_a_keyframe_that_was_changed_during_the_run_keeps_no_assessment_of_the_pose_before(
    session, store, audited, keyframe
):
    edited = replace(keyframe, values=keyframe.values + 0.1)

    def edit(step):
        if isinstance(step, AuditStep) and step.done == N:
            store.amend(store.history(1)[0].edit, [PoseChange("person", WRONG, edited)])

    track(session, store, stop=edit)
    found = store.pose("person", WRONG)
    np.testing.assert_array_equal(found.values, edited.values)
    assert found.status == ""


def test_the_keyframe_that_a_run_goes_out_from_is_assessed_by_the_colors_of_the_run_alone(
    session, store, audited, monkeypatch
):
    """Tracks agree with it in any case: they went out from it."""
    track(session, store)
    assert store.pose("person", 0).status == ""
    store.undo()
    n = len(limbs(session.people[0].model))

    def steps(repair):
        pose = session.people[0].model.neutral()
        yield RepairStep(1, 1, {0: {0: RepairedPose(pose, np.ones((4, n), np.bool_), np.full(n, 20.0), ("arm",) * n)}})

    monkeypatch.setattr(RunRepair, "steps", steps)
    track(session, store)
    found = store.pose("person", 0)
    assert (found.status, found.remark) == ("lost", "left arm uncertain: arm")
    assert found.values[0] == 0.0


def test_the_searches_of_the_repair_follow_those_of_the_tracker_and_replace_those_of_an_earlier_one(session):
    first, earlier, later = (
        Search(kind, ("left_forearm",), before, None, False)
        for kind, before in (("limbs", 5.0), ("repair", 4.0), ("repair", 3.0))
    )
    model = session.people[0].model
    pose, n = model.neutral(), len(limbs(model))
    repaired = RepairedPose(pose, np.ones((3, n), np.bool_), np.zeros(n), ("",) * n, (later,))
    for trace, expected in (((first, earlier), (first, later)), ((), (later,)), (None, (later,))):
        record = PoseRecord(pose, ("tracked",) * len(pose), 1, trace=trace)
        assert with_repair(model, record, repaired).trace == expected
    unknown = PoseRecord(pose, ("tracked",) * len(pose), 1)
    assert with_repair(model, unknown, repaired._replace(trace=())).trace is None


def test_the_searches_of_a_run_are_stored(session, store, audited, monkeypatch):
    n, entry = len(limbs(session.people[0].model)), Search("repair", ("left_forearm",), 9.0, 2.0, True)
    estimates = Stands.estimates

    def steps(repair):
        pose = session.people[0].model.neutral()
        repaired = RepairedPose(pose, np.ones((4, n), np.bool_), np.zeros(n), ("",) * n, (entry,))
        yield RepairStep(1, 1, {0: {WRONG: repaired}})

    tracked = Search("limbs", ("right_calf",), 4.0, None, False)
    monkeypatch.setattr(RunRepair, "steps", steps)
    monkeypatch.setattr(
        Stands, "estimates", lambda self, run: (e._replace(traces=((tracked,),)) for e in estimates(self, run))
    )
    track(session, store)
    assert [store.pose("person", k).trace for k in (0, 1, WRONG)] == [None, (tracked,), (tracked, entry)]


def test_it_can_be_left_out(session, store, audited):
    track(session, store, replace(SETTINGS, audit=False))
    assert audited == []
    found = records(store)
    assert found[WRONG].values[0] == 0.5
    assert {r.errors is None for r in found} == {True}


@pytest.mark.parametrize("smooth", [False, True])
def test_a_run_that_was_stopped_meanwhile_ends_like_one_without_a_break(session, store, audited, smooth):
    settings = replace(SETTINGS, smooth=smooth)
    track(session, store, settings)
    whole = [(r.values.tobytes(), r.status, None if r.errors is None else r.errors.tobytes()) for r in records(store)]
    store.undo()
    stopped = track(session, store, settings, stop=lambda step: isinstance(step, AuditStep) and step.done == 3)
    assert not stopped.finished
    assert records(store)[WRONG].values[0] == 0.5  # as tracked
    resumed = track(session, store, settings)
    assert (resumed.finished, resumed.frames) == (True, [])
    again = [(r.values.tobytes(), r.status, None if r.errors is None else r.errors.tobytes()) for r in records(store)]
    assert again == whole


def test_a_short_run_has_no_tracks_with_a_history(session, store, audited):
    plan = TrackPlan(range(HISTORY_FRAMES), (0,), SETTINGS)
    with stored_run(session, store, OBSERVER, plan) as run:
        for step in run.steps():
            run.take(step)
    assert audited == []
    assert store.pose("person", WRONG).values[0] == 0.5


@pytest.mark.parametrize(
    ("has_history", "elsewhere_nats", "status"),
    [(False, None, "lost"), (True, None, "good"), (False, 2.0, "good"), (True, 8.0, "doubtful"), (True, 20.0, "lost")],
)
def test_near_the_start_features_count_where_the_colors_of_the_run_are_unknown(has_history, elsewhere_nats, status):
    model = load_model("gavrila22")
    pose, n = model.neutral(), len(limbs(model))
    tracks = FrameTracks(np.array([pose] * 3), np.ones((3, n)), ("a", "b", "c"), has_history)
    features = np.zeros((n, 8))
    features[1] = [3, 1, -2, 0, 1, 0, 0, 0]  # of a limb that is lost
    record = PoseRecord(pose, ("tracked",) * len(pose), 1)
    found = agreement(model, pose, tracks.poses, tracks.trust)
    repaired = None
    if elsewhere_nats is not None:
        repaired = RepairedPose(
            pose,
            np.ones((3, n), np.bool_),
            np.array([-5.0, elsewhere_nats, *[-5.0] * (n - 2)]),
            ("hand elsewhere in A",) * n,
        )
    assessed = assessed_by_tracks(model, record, found, tracks, False, features, repaired)
    assert assessed.status == status
    assert assessed.remark.endswith(": hand elsewhere in A") is (repaired is not None and status != "good")


@pytest.mark.parametrize(
    ("nats", "searched", "status"), [(8.0, False, "doubtful"), (8.0, True, "good"), (11.0, True, "doubtful")]
)
def test_colors_count_less_against_a_limb_that_was_searched(nats, searched, status):
    model = load_model("gavrila22")
    pose, names = model.neutral(), [x.name for x in limbs(model)]
    n = len(names)
    tracks = FrameTracks(np.array([pose] * 3), np.ones((3, n)), ("a", "b", "c"))
    found = agreement(model, pose, tracks.poses, tracks.trust)
    repaired = RepairedPose(
        pose, np.ones((3, n), np.bool_), np.array([nats, *[-5.0] * (n - 1)]), ("hand elsewhere in A",) * n,
        alternatives=(), searched=(names[0],) if searched else (),
    )  # fmt: skip
    record = PoseRecord(pose, ("tracked",) * len(pose), 1)
    assert assessed_by_tracks(model, record, found, tracks, False, None, repaired).status == status


def test_poses_that_the_repair_found_about_as_good_take_the_place_of_those_of_the_tracker():
    model = load_model("gavrila22")
    pose, n = model.neutral(), len(limbs(model))
    other = pose.copy()
    other[model.value_names.index("left_shoulder.elevation")] += 1.0
    tracks = FrameTracks(np.array([pose] * 3), np.ones((3, n)), ("a", "b", "c"))
    noted, back = "right leg may be elsewhere", "tracked back from frame 9"
    record = PoseRecord(pose, ("tracked",) * len(pose), 7, remark=f"{noted}, {back}")
    change = PoseChange("person", 4, record, (Alternative(pose + 0.3, 7),))
    agreed = agreement(model, pose, tracks.poses, tracks.trust)
    alone = RepairedPose(pose, np.ones((3, n), np.bool_), np.full(n, -5.0), ("",) * n)
    rivals = (Hypothesis(PosedBody(model, other), cost=0.5),)
    for repaired, status, remarks, poses in (
        (alone, "good", [back], []),
        (alone._replace(alternatives=rivals), "doubtful", [back, "left arm may be elsewhere"], [other]),
    ):  # fmt: skip
        kept = with_alternatives(change, repaired)
        assert [a.values.tolist() for a in kept.alternatives] == [p.tolist() for p in poses]
        assert {a.model_revision for a in kept.alternatives} <= {7}
        is_ambiguous = len(kept.alternatives) > 0
        known = with_repair(model, record, repaired)
        assessed = assessed_by_tracks(model, known, agreed, tracks, is_ambiguous, None, repaired)
        assert assessed.status == status
        assert [r for r in assessed.remark.split(", ") if r != "left arm uncertain: "] == remarks


@pytest.mark.parametrize(
    ("pulled_m", "cost", "status", "remark"),
    [
        (0.0, None, "good", ""),
        (0.04, None, "good", ""),
        (0.08, None, "doubtful", "left arm uncertain: contours elsewhere"),
        (0.15, None, "lost", "left arm uncertain: contours elsewhere"),
        (0.0, -2.0, "good", ""),
        (0.0, -7.0, "doubtful", "left arm may be elsewhere"),
    ],
)
def test_a_keyframe_is_in_doubt_by_its_own_frame_and_not_by_tracks_alone(pulled_m, cost, status, remark):
    model = load_model("gavrila22")
    pose, n = model.neutral(), len(limbs(model))

    def moved(by_m):
        angle = by_m / np.linalg.norm(model.points_world(pose)[wrist] - model.points_world(pose)[shoulder])
        other = pose.copy()
        other[model.value_names.index("left_shoulder.elevation")] += angle
        return other

    shoulder, wrist = (model.point_names.index(f"left_{name}") for name in ("shoulder", "wrist"))
    tracks = FrameTracks(np.array([moved(0.09)] * 3), np.ones((3, n)), ("a", "b", "c"))
    others = () if cost is None else (Hypothesis(PosedBody(model, moved(0.4)), cost=cost),)
    repaired = RepairedPose(
        pose, np.ones((3, n), np.bool_), np.full(n, -50.0), ("",) * n, alternatives=others, refined=moved(pulled_m)
    )
    found = assessed_keyframe(model, "person", 4, PoseRecord(pose, ("manual",) * len(pose), 1), tracks, repaired)
    assert (found.status, found.remark) == (status, remark)
    tip = np.sqrt(np.trace(found.errors[wrist]))
    assert tip == pytest.approx(0.09, abs=0.03)  # the error bars tell how far the tracks are apart
    by_tracks = assessed_keyframe(model, "person", 4, PoseRecord(pose, ("manual",) * len(pose), 1), tracks)
    assert by_tracks.status == "doubtful"
