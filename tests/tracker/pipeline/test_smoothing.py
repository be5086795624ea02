"""The end of a stored run: smoothed rows, final statuses, keyframes, undo, and a run that was interrupted."""

import shutil
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tracker.body.limbs import limbs
from tracker.compute.progress import result_of
from tracker.errors import DamagedStoreError
from tracker.formats.model_toml import format_model, load_model
from tracker.pipeline.methods import METHODS
from tracker.pipeline.smoothing import TrackedRows, resumed_rows
from tracker.pipeline.stored_run import TrackPlan, stored_run
from tracker.pipeline.track_session import EstimatedRows
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.tracking.confidence import LimbFeatures, PoseQuality
from tracker.tracking.estimate import AlternativePose, PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.voxel.method import VOXEL
from tracker.tracking.voxel.settings import VoxelSettings

N = 12
CLEAR = PoseQuality(
    0.05, 4, 0.0, 0.02,
    tuple(LimbFeatures(n, 1.0, 0.0, 1.2, 0.05, 0.6, 0.5, 0.0, 1.2, 0.06, 1.0, 1.0, 0.01) for n in "abcde"),
)  # fmt: skip
"""Of a pose that its own frame does not contradict."""
SETTINGS = VoxelSettings()


@dataclass
class Jittery:
    """Stands for a tracker: walks along x, 2 cm to and fro beside the path; has alternatives on frame 4."""

    settings: VoxelSettings
    quality: PoseQuality | None = None

    def estimates(self, run):
        for frame in run.frames:
            pose = np.array(run.start[0][-1])
            pose[0] = tracked_x(frame) + (0.4 if frame == 9 and self.quality else 0)
            pose = run.subjects.keyframes_at(frame).get(0, pose)
            n = run.subjects.models[0].n_dofs
            alternatives = ((AlternativePose(pose + 0.1, 3.0),),) if frame == 4 else ((),)
            yield PoseEstimate(
                frame, (pose,), 1.0 + frame, np.ones(4), 0, ("good",), (f"note {frame}",), (np.ones(10),),
                (1e-4 * np.eye(n),), (self.quality,), alternatives, "voxel",
            )  # fmt: skip


@pytest.fixture
def session(tmp_path, sample_folder, monkeypatch):
    monkeypatch.setitem(METHODS, "voxel", replace(VOXEL, make_tracker=Jittery))
    return load_session(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    """With keyframes on frames 0 and 6."""
    store, (person,) = AnnotationStore(session.annotations_path), session.people
    revision = store.add_model_revision(person.name, format_model(person.model))
    for frame in (0, 6):
        values = person.model.neutral()
        values[0] = 0.05 * frame
        store.commit(
            "init", [PoseChange(person.name, frame, PoseRecord(values, ("manual",) * len(values), revision, True))]
        )
    yield store
    store.close()


def track(session, store, settings=SETTINGS, n=None):
    """Take so many steps, or all."""
    with stored_run(session, store, None, TrackPlan(range(N), (0,), settings)) as run:
        for k, step in enumerate(run.steps(), start=1):
            run.take(step)
            if k == n:
                break
    return run


def records(store):
    return [store.pose("person", k) for k in range(N)]


def x_of(store):
    return np.array([r.values[0] for r in records(store)])


def jitter(x):
    return np.abs(np.diff(x, n=2)).mean()


def test_a_run_is_smoothed_as_part_of_its_entry(session, store):
    run = track(session, store)
    assert run.finished
    smoothed = x_of(store)
    assert store.undo() == f"track frames 0:{N}"
    assert [r.frame for r in store.frames("person")] == [0, 6]
    track(session, store, replace(SETTINGS, whole_run=False))
    assert jitter(smoothed) < 0.3 * jitter(x_of(store))
    assert np.abs(smoothed - 0.05 * np.arange(N)).max() < 0.02


def test_everything_but_the_poses_stays(session, store):
    track(session, store, replace(SETTINGS, whole_run=False))
    before, alternatives = records(store), store.alternatives("person", 4)
    store.undo()
    track(session, store)
    for old, new in zip(before, records(store), strict=True):
        if not old.keyframe:
            assert not np.array_equal(new.values, old.values)
            assert (new.status, new.cost_px, new.remark, new.sources, new.part_costs_px) == (
                old.status, old.cost_px, old.remark, old.sources, old.part_costs_px,
            )  # fmt: skip
    (kept,), (expected,) = store.alternatives("person", 4), alternatives
    np.testing.assert_array_equal(kept.values, expected.values)
    assert kept.cost_px == expected.cost_px


def test_keyframes_are_bit_identical(session, store):
    before = [store.pose("person", k).values.tobytes() for k in (0, 6)]
    track(session, store)
    for k, values in zip((0, 6), before, strict=True):
        record = store.pose("person", k)
        assert record.values.tobytes() == values
        assert record.keyframe
        assert set(record.sources) == {"manual"}


def test_locked_degrees_of_freedom_keep_their_values(session, store):
    store.set_setting("locked", {"person": ["torso.x"]})
    track(session, store, replace(SETTINGS, whole_run=False))
    before = x_of(store)
    store.undo()
    track(session, store)
    np.testing.assert_array_equal(x_of(store), before)


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 9, N])
def test_a_resumed_run_ends_like_one_without_a_break(session, store, n):
    track(session, store)
    whole = [r.values for r in records(store)]
    store.undo()
    run = track(session, store, n=n)
    assert not run.finished
    assert x_of_tracked(store, n) == pytest.approx([tracked_x(k) for k in range(n) if k not in (0, 6)])
    run = track(session, store)
    assert len(run.frames) == N - n
    np.testing.assert_array_equal([r.values for r in records(store)], whole)


def tracked_x(frame):
    return 0.05 * frame + 0.02 * (-1) ** frame


def x_of_tracked(store, n):
    return [store.pose("person", k).values[0] for k in range(n) if k not in (0, 6)]


def test_a_run_interrupted_before_its_smoothed_poses_are_written_is_not_smoothed_in_part(session, store):
    with stored_run(session, store, None, TrackPlan(range(N), (0,), SETTINGS)) as run:
        for step in run.steps():
            if isinstance(step, EstimatedRows):
                break
            run.take(step)
    assert not run.finished
    assert jitter(x_of(store)[7:]) == pytest.approx(0.08)
    track(session, store)
    assert jitter(x_of(store)[7:]) < 0.03


@pytest.fixture
def with_a_leap(monkeypatch):
    """The person is 40 cm ahead on frame 9, where the frame does not contradict that."""

    def fewer_limbs(settings):
        return Jittery(settings, CLEAR._replace(limbs=CLEAR.limbs[:4]))

    monkeypatch.setitem(METHODS, "voxel", replace(VOXEL, make_tracker=fewer_limbs))
    monkeypatch.setitem(globals(), "tracked_x", lambda frame: 0.05 * frame)


def test_a_leap_is_doubted_at_the_end_of_the_run(session, store, with_a_leap):
    track(session, store, replace(SETTINGS, whole_run=False))
    assert {r.status for r in records(store) if not r.keyframe} == {"good"}
    store.undo()
    run = track(session, store)
    leap, far = records(store)[9], records(store)[2]
    assert (far.status, far.remark) == ("good", "note 2")
    assert leap.status != "good"
    assert max(leap.limbs_lost) > 3 * max(far.limbs_lost)
    assert len(leap.limbs_lost) == 4
    assert records(store)[4].status == "doubtful"  # it has alternatives
    assert run.status_counts()[0][leap.status] >= 1
    assert sum(run.status_counts()[0].values()) == N


def test_a_resumed_run_has_the_same_statuses(session, store, with_a_leap):
    track(session, store)
    whole = [(r.status, r.limbs_lost, r.remark) for r in records(store)]
    store.undo()
    track(session, store, n=10)
    track(session, store)
    assert [(r.status, r.limbs_lost, r.remark) for r in records(store)] == whole


def test_reasons_follow_the_final_status():
    """Another reason than a doubtful limb stays."""
    rows = TrackedRows()
    model = load_model("gavrila34")
    doubtful = CLEAR._replace(
        limbs=tuple(x._replace(name=y.name) for x, y in zip(CLEAR.limbs, limbs(model), strict=True))
    )
    remarks = ["left arm uncertain", "left arm relocated", "", "body searched"]
    for frame, remark in enumerate(remarks):
        pose = PoseRecord(model.neutral(), (), 1, status="doubtful", remark=remark, limbs_lost=(0.1,) * 5)
        rows.add(PoseChange("person", frame, pose), 1e-4 * np.eye(model.n_dofs), doubtful)
    found = [c.pose for c in result_of(rows.finished(Subjects.of([model]), 0, 25.0))]
    assert [p.status for p in found] == ["good"] * 4
    assert [p.remark for p in found] == ["", "left arm relocated", "", "body searched"]


def test_an_interrupted_run_of_an_older_version_keeps_its_statuses():
    """It recorded covariances alone, one text per frame."""
    model, rows, old = load_model("gavrila34"), TrackedRows(), TrackedRows()
    for frame in range(4):
        pose = PoseRecord(model.neutral(), (), 1, status="doubtful", remark="x", limbs_lost=(0.1,) * 5)
        rows.add(PoseChange("person", frame, pose), 1e-4 * np.eye(model.n_dofs), CLEAR)
        old.restore(PoseChange("person", frame, pose), rows.record()[str(frame)][0])
    assert [c.pose.status for c in result_of(old.finished(Subjects.of([model]), 0, 25.0))] == ["doubtful"] * 4
    assert [c.pose.status for c in result_of(rows.finished(Subjects.of([model]), 0, 25.0))] == ["good"] * 4


@pytest.mark.parametrize("texts", [["AA=="], [""], ["AADAfwAAwH8AAMB/"], ["x"], []], ids=str)
def test_odd_texts_of_an_interrupted_run_are_refused(texts):
    model = load_model("gavrila34")
    change = PoseChange("person", 3, PoseRecord(model.neutral(), (), 1))
    with pytest.raises(DamagedStoreError, match="covariance and features of frame 3"):
        resumed_rows({0: (change,)}, {"0": {"3": texts}})


def one_row(rows, model, frame, pose, lost=()):
    status = "lost" if max(lost, default=0) > 0.25 else "good"
    record = PoseRecord(pose, ("tracked",) * len(pose), 1, status=status, limbs_lost=lost)
    rows.add(PoseChange("person", frame, record), 1e-4 * np.eye(model.n_dofs), None)


def test_a_limb_in_doubt_stays_where_it_was_found_and_its_motion_tells_about_it():
    model, rows = load_model("gavrila34", 1.7), TrackedRows()
    raised = model.dof_names.index("left_shoulder.abduction")
    arm = next(i for i, limb in enumerate(limbs(model)) if limb.dofs[raised])
    for frame in range(N):
        pose = model.neutral()
        pose[raised] += 1.0 * (frame == 6)
        one_row(rows, model, frame, pose, tuple(0.4 * (i == arm and frame == 6) for i in range(len(limbs(model)))))
    smoothed, by_motion = result_of(rows.smoothed(Subjects.of([model]), 0, 5.0))
    angles = np.array([change.pose.values[raised] for change in smoothed]) - model.neutral()[raised]
    assert angles[6] > 0.8
    assert by_motion[6][raised] - model.neutral()[raised] < 0.3
