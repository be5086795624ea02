"""A task tracks a session once, also where it is done again, and shares the body that it has acquired."""

import shutil
from dataclasses import replace

import pytest
from bodies import MODELS
from command_line import SAMPLE
from stored_motions import store_motion

import quadrille
from tracker.api.work import Tracked
from tracker.batch.manifest import Manifest
from tracker.batch.plan import read_plan
from tracker.batch.worker import do_task
from tracker.evaluation.references import read_joints
from tracker.formats.model_toml import load_model
from tracker.pipeline.given_pose import set_pose_at_joints
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture
def manifest(tmp_path):
    """A batch of one copy of the bundled sample with a first pose."""
    folder = shutil.copytree(SAMPLE, tmp_path / "a")
    session = quadrille.open_session(folder)
    set_pose_at_joints(session, 0, 0, read_joints(SAMPLE / "truth.trc", session.fps), fit_sizes=False)
    plan = tmp_path / "plan.toml"
    plan.write_text(
        'sessions = ["a"]\n[settings]\nacquire = false\nframes = "0:3"\nexport = ["csv"]\noptions = {whole_run = false}'
    )
    return Manifest.create(read_plan(plan, tmp_path / "out"), tmp_path / "out")


def labels(folder):
    """Entries of the history."""
    with AnnotationStore(folder / "annotations.sqlite", read_only=True) as store:
        return [entry.label for entry in store.history()]


@pytest.mark.slow
def test_a_task_that_died_before_its_result_does_not_track_again(manifest, tmp_path):
    (task,) = manifest.tasks
    first = do_task(task, manifest.folder, lambda stage, share: None)
    before = labels(tmp_path / "a")
    again = do_task(task, manifest.folder, lambda stage, share: pytest.fail("it tracks again"))
    assert labels(tmp_path / "a") == before
    assert again == first
    assert again.tracked.statuses == {"person": {"good": 2}}
    assert [path.name for path in again.files] == ["a.csv", "a_angles.csv"]


def test_recordings_and_people_of_like_names_have_files_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr("tracker.batch.worker.track", lambda *_, **__: Tracked(1, {}, 1.0, 0, ""))
    people = {"x/y": ("Ann",), "x_y": ("ann",), "x/z": ("y", "w_v"), "x/z_w": ("v", "u")}
    for i, (name, own) in enumerate(people.items()):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        body = replace(MODELS["gavrila22"], name="own", height_m=1.5 + 0.1 * i)
        store_motion(tmp_path / name, [body] * len(own), n_frames=2, names=own)
    plan = tmp_path / "plan.toml"
    plan.write_text(f"sessions = {list(people)}\nfreeze_bodies = true\nsettings = {{export = ['trc', 'csv']}}")
    Manifest.create(read_plan(plan, tmp_path / "out"), tmp_path / "out")
    tasks = Manifest.load(tmp_path / "out").tasks
    files = [path for task in tasks for path in do_task(task, tmp_path / "out", lambda stage, share: None).files]
    assert len({str(path).casefold() for path in files}) == len(files) == 6 + 2 * 4
    assert all(path.is_file() for path in files)
    bodies = [load_model(path).height_m for path in (tmp_path / "out" / "bodies").iterdir()]
    assert len(bodies) == 6
    assert min(bodies) == 1.5
