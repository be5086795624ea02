"""A task tracks a session once, also where it is done again, and shares the body that it has acquired."""

import shutil
from contextlib import closing

import pytest
from command_line import SAMPLE

import tracker
from tracker.batch.manifest import Manifest
from tracker.batch.plan import read_plan
from tracker.batch.tasks import do_task
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints
from tracker.store.annotation_store import AnnotationStore


@pytest.fixture
def manifest(tmp_path):
    """A batch of one copy of the bundled sample with a first pose."""
    folder = shutil.copytree(SAMPLE, tmp_path / "a")
    session = tracker.open_session(folder)
    set_pose_at_joints(session, 0, 0, read_joints(SAMPLE / "truth.trc", session.fps), fit_sizes=False)
    plan = tmp_path / "plan.toml"
    plan.write_text(
        'sessions = ["a"]\nsettings = {acquire = false, frames = "0:3", export = ["csv"], options = {audit = false}}'
    )
    return Manifest.create(read_plan(plan, tmp_path / "out"), tmp_path / "out")


def labels(folder):
    """Entries of the history."""
    with closing(AnnotationStore(folder / "annotations.sqlite", read_only=True)) as store:
        return [entry.label for entry in store.history()]


def test_a_task_that_died_before_its_result_does_not_track_again(manifest, tmp_path):
    (task,) = manifest.tasks
    first = do_task(task, manifest.folder, lambda stage, share: None)
    before = labels(tmp_path / "a")
    again = do_task(task, manifest.folder, lambda stage, share: pytest.fail("it tracks again"))
    assert labels(tmp_path / "a") == before
    assert again == first
    assert again.tracked.statuses == {"person": {"good": 2}}
    assert [path.name for path in again.files] == ["a.csv", "a_angles.csv"]
