"""Where long recordings are cut, how their stretches are joined, and what becomes of names and of failures."""

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from batch_work import make_batch
from bodies import MODELS
from stored_motions import store_motion

from tracker.api.work import Tracked
from tracker.batch.join import TrackedStretch, join
from tracker.batch.manifest import Manifest
from tracker.batch.plan import Settings
from tracker.batch.stretch_work import FOUND
from tracker.batch.stretches import Division, RecordingStretch, divide
from tracker.batch.task_files import Result
from tracker.batch.worker import Done, work
from tracker.errors import TrackerError
from tracker.pipeline.keyframe_stretches import pose_checksum
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import BETWEEN, PoseChange, PoseRecord

MODEL = MODELS["gavrila38"]


def frames_of(stretches):
    return [(s.first, s.last) for s in stretches]


def test_stretches_without_keyframes_share_a_second():
    stretches = divide(range(3000), (), 1000, fps=30.0)
    assert frames_of(stretches) == [(0, 1014), (985, 2014), (1985, 2999)]


@pytest.mark.parametrize(("n", "length", "parts"), [(1999, 1000, 1), (2000, 1000, 2), (20000, 1000, 20), (5000, 0, 1)])
def test_a_stretch_has_at_least_its_length(n, length, parts):
    stretches = divide(range(n), (), length, fps=30.0)
    assert len(stretches) == parts
    assert (stretches[0].first, stretches[-1].last) == (0, n - 1)
    assert all(s.last - s.first + 1 >= length for s in stretches)


def test_a_recording_is_cut_at_the_nearest_keyframe_which_both_stretches_have():
    stretches = divide(range(3000), {100, 900, 2600}, 1000, fps=30.0)
    assert frames_of(stretches) == [(0, 900), (900, 1964), (1935, 2999)]


def test_strides_count_tracked_frames():
    stretches = divide(range(10, 4010, 2), (), 1000, fps=30.0)
    assert frames_of(stretches) == [(10, 2024), (1994, 4008)]
    assert all((s.first - 10) % 2 == 0 for s in stretches)


class Scene:
    """A session of some people, and stretches of it with stored poses."""

    def __init__(self, folder, n_people=1, n_frames=40, cuts=((0, 24), (15, 39))):
        self.folder = folder
        gaps = {(i, f) for i in range(n_people) for f in range(n_frames)}
        self.session, _ = store_motion(folder / "session", [MODEL] * n_people, n_frames=n_frames, gaps=gaps)
        stretches = tuple(RecordingStretch(i, a, b) for i, (a, b) in enumerate(cuts))
        self.division = Division((0, n_frames, 1), tuple(range(n_people)), 5, stretches)

    def pose(self, person, frame, off_m=0.0):
        """A person walks along x; several stand two metres apart."""
        pose = MODEL.neutral().copy()
        pose[:3] = (0.01 * frame + off_m, 2.0 * person, 0.9)
        return pose

    def part(self, number, off_m=None, names=None, found=True, keyframes=()):
        """Track a stretch: off by some metres on each frame, and people under the names of others."""
        stretch = self.division.stretches[number]
        folder = self.folder / f"part{number}{stretch.key}"
        copy, _ = store_motion(
            folder, [MODEL] * len(self.session.people), n_frames=40, gaps={(i, f) for i in (0, 1) for f in range(40)}
        )
        with AnnotationStore(copy.annotations_path) as store:
            for i, person in enumerate(self.session.people):
                revision = store.model_revisions(person.name)[0].id
                who = names[i] if names else i
                store.commit(
                    "track", [PoseChange(person.name, k, PoseRecord(self.pose(who, k, off_m(k) if off_m else 0.0),
                    ("tracked",) * len(MODEL.neutral()), revision, status="good", keyframe=k in keyframes,),) for k in
                    range(stretch.first, stretch.last + 1)],
                )  # fmt: skip
            store.set_setting(FOUND, found)
        n = stretch.last - stretch.first + 1
        return TrackedStretch(stretch, folder, Tracked(n, {}, 1.0 + number, stretch.first + 3, ""))

    def stored(self, person="ann"):
        with AnnotationStore(self.session.annotations_path, read_only=True) as store:
            return store.poses(person, range(40)), [e.label for e in store.history()]


def quiet(stage, share):
    """Show no progress."""


def test_stretches_are_joined_where_their_tracks_agree_best(tmp_path):
    scene = Scene(tmp_path)
    apart = {k: 0.001 * abs(k - 21) + 0.002 for k in range(40)}
    parts = [scene.part(0, found=False), scene.part(1, apart.get)]
    joined = join(scene.session, scene.division, parts, "task", quiet)
    ((frame, person, apart_mm),) = [(s.frame, s.person, s.apart_mm) for s in joined.seams]
    assert (frame, person) == (21, "ann")
    assert apart_mm == pytest.approx(2.0)
    assert not joined.seams[0].is_over
    poses, labels = scene.stored()
    assert labels[0] == "track frames 0:40"
    assert list(poses) == list(range(40))
    for k, pose in poses.items():
        np.testing.assert_allclose(pose.values, scene.pose(0, k, apart[k] if k >= 21 else 0.0))
        assert (BETWEEN in pose.settings) == (15 <= k <= 24)
    assert poses[20].settings[BETWEEN] == [3, 18]
    assert joined.tracked == Tracked(40, {"ann": {"good": 40}}, pytest.approx(1.5), 5, "")


def test_a_seam_over_the_tolerance_is_named_and_doubted(tmp_path):
    scene = Scene(tmp_path)
    parts = [scene.part(0), scene.part(1, lambda k: 0.12)]
    joined = join(scene.session, scene.division, parts, "task", quiet)
    (seam,) = joined.seams
    assert seam.is_over
    poses, _ = scene.stored()
    assert {k for k, p in poses.items() if p.status != "good"} == set(range(15, 25))
    assert "tracked from frames 3 and 18, it lies 120 mm apart" in poses[15].remark
    assert joined.tracked.statuses == {"ann": {"good": 30, "doubtful": 10}}


def test_stretches_that_share_a_keyframe_have_no_seam(tmp_path):
    scene = Scene(tmp_path, cuts=((0, 20), (20, 39)))
    with AnnotationStore(scene.session.annotations_path) as store:
        record = PoseRecord(scene.pose(0, 20), ("manual",) * len(MODEL.neutral()), 1, keyframe=True)
        store.commit("place", [PoseChange("ann", 20, record)])
    parts = [scene.part(0, keyframes={20}), scene.part(1, keyframes={20})]
    joined = join(scene.session, scene.division, parts, "task", quiet)
    assert joined.seams == ()
    poses, _ = scene.stored()
    assert len(poses) == 40
    assert poses[20].keyframe
    assert poses[20].status == "good"
    assert pose_checksum(poses[20].values) == pose_checksum(scene.pose(0, 20))


def test_people_who_were_found_under_the_names_of_others_are_tracked_once_more(tmp_path):
    scene = Scene(tmp_path, n_people=2)
    parts = [scene.part(0, found=False), scene.part(1, names=(1, 0))]
    found = join(scene.session, scene.division, parts, "task", quiet)
    assert isinstance(found, Division)
    assert [s.names for s in found.stretches] == [(), (1, 0)]
    assert found.stretches[1].key == "001-1-0"
    assert scene.stored()[0] == {}
    scene.division = found
    again = [parts[0], scene.part(1)]
    joined = join(scene.session, found, again, "task", quiet)
    assert [s.apart_mm for s in joined.seams] == [0.0, 0.0]


def test_names_that_are_sure_stay_and_the_seam_tells(tmp_path):
    scene = Scene(tmp_path, n_people=2)
    parts = [scene.part(0, found=False), scene.part(1, names=(1, 0), found=False)]
    joined = join(scene.session, scene.division, parts, "task", quiet)
    assert [s.is_over for s in joined.seams] == [True, True]


def test_a_join_that_was_interrupted_goes_on_in_its_entry_of_the_history(tmp_path):
    scene = Scene(tmp_path)
    parts = [scene.part(0), scene.part(1)]

    def stop(stage, share):
        if share > 0:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        join(scene.session, scene.division, parts, "task", stop)
    assert len(scene.stored()[0]) == 15
    before = scene.stored()[1]
    join(scene.session, scene.division, parts, "task", quiet)
    poses, labels = scene.stored()
    assert len(poses) == 40
    assert labels == before


class Stretched:
    """Does tasks of a long recording: divides it, tracks its stretches, joins them."""

    def __init__(self, failing=()):
        self.failing, self.done = failing, []

    def __call__(self, task, folder, progress):
        self.done.append(task.key)
        if task.stretch is not None:
            if task.stretch.number in self.failing:
                raise TrackerError("expected a person, found none")
            return Done(Tracked(10, {}, 1.0, 0, ""), ())
        if task.division is None:
            return Division((0, 30, 1), (0,), 3, divide(range(30), (), 10, 1.0))
        if task.failed:
            raise TrackerError(f"failed: {task.failed}")
        return Done(Tracked(30, {"ann": {"good": 30}}, 1.0, 3, ""), ())


def test_a_long_recording_is_begun_tracked_in_stretches_and_joined(tmp_path):
    manifest, do = make_batch(tmp_path, 1), Stretched()
    assert manifest.n_parts() == 1
    assert work(tmp_path, max_tasks=1, do=do) == 1
    assert manifest.n_parts() == 3
    assert manifest.counts() == {"waiting": 1}
    work(tmp_path, do=do)
    assert do.done == ["000000", "000000_000", "000000_001", "000000_002", "000000"]
    assert manifest.result(manifest.tasks[0]).n_stretches == 3
    assert manifest.counts() == {"done": 1}
    assert list(manifest.ended_parts()) == ["000000_000", "000000_001", "000000_002", "000000"]


def test_a_recording_is_running_while_a_stretch_is(tmp_path):
    manifest, do = make_batch(tmp_path, 1), Stretched()
    work(tmp_path, max_tasks=1, do=do)
    part, held = manifest.claim_next()
    assert part.stretch.number == 0
    assert manifest.counts() == {"running": 1}
    other, _ = manifest.claim_next()
    assert other.stretch.number == 1
    held.release()
    assert manifest.claim_next()[0].stretch.number == 0


def test_a_stretch_that_failed_can_be_tried_again_alone(tmp_path):
    manifest, do = make_batch(tmp_path, 1), Stretched(failing={1})
    work(tmp_path, do=do)
    assert "failed: ((1, 'expected a person, found none'),)" in manifest.result(manifest.tasks[0]).error
    assert manifest.retry() == 1
    again = Stretched()
    work(tmp_path, do=again)
    assert again.done == ["000000_001", "000000"]
    assert manifest.counts() == {"done": 1}


def test_stretches_with_other_names_are_open_again(tmp_path):
    manifest, do = make_batch(tmp_path, 1), Stretched()
    work(tmp_path, max_tasks=4, do=do)
    task, held = manifest.claim_next()
    assert (task.stretch, len(task.stretches())) == (None, 3)
    named = [msgspec.structs.replace(s, names=(1, 0) if s.number == 1 else ()) for s in task.division.stretches]
    manifest.divide(task, held, msgspec.structs.replace(task.division, stretches=tuple(named)))
    part, held = manifest.claim_next()
    assert part.key == "000000_001-1-0"
    manifest.finish(part, held, Result("done"))
    assert manifest.claim_next()[0].key == "000000"


def test_time_of_all_visits_and_stretches_is_counted(tmp_path):
    manifest, do = make_batch(tmp_path, 1), Stretched()
    work(tmp_path, max_tasks=1, do=do)
    path = tmp_path / "stretches" / "000000.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "seconds": 100.0, "cpu_seconds": 50.0}))
    part, held = manifest.claim_next()
    manifest.finish(part, held, Result("done", seconds=10.0, cpu_seconds=5.0))
    work(tmp_path, do=do)
    result = manifest.result(manifest.tasks[0])
    assert result.seconds == pytest.approx(110.0, abs=1.0)
    assert result.cpu_seconds == pytest.approx(55.0, abs=1.0)


def test_settings_say_how_long_stretches_are(tmp_path):
    assert Settings().stretch_frames == 1000
    assert Settings(stretch=0).stretch_frames == 0
    manifest = Manifest.load(make_batch(tmp_path, 2).folder)
    assert [t.n_expected for t in manifest.tasks] == [1, 1]
    assert manifest.tasks[0].session(Path("out")) == tmp_path / "r000"
