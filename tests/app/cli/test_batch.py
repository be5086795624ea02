"""`quadrille batch`: ways to run it that exclude one another, memory, scripts of a job array, the table."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from bodies import MODELS
from command_line import assert_refused, output_of
from full_disks import full_disk
from stored_motions import store_motion

from app.cli.batches.local import n_workers
from tracker.batch.manifest import Manifest
from tracker.batch.task_files import Result
from tracker.batch.worker import work
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

GB = 1 << 30


@pytest.fixture
def plan(tmp_path):
    """A plan of two sessions with poses in a folder whose name has a space."""
    folder = tmp_path / "my lab"
    folder.mkdir()
    for name in ("a", "b"):
        session, _ = store_motion(
            folder / name, [MODELS["gavrila38"]], n_frames=4, lost={(0, 2)} if name == "b" else ()
        )
        for camera in session.cameras:
            camera.footage.touch()
    path = folder / "plan.toml"
    path.write_text('sessions = ["a", "b"]')
    return path


@pytest.fixture
def ended(plan, run):
    """The same after a batch in which a was tracked, and b was not."""
    run("batch", plan, "--slurm")
    manifest = Manifest.load(plan.with_name("plan_batch"))
    for task, result in zip(
        manifest.tasks,
        (
            Result("done", "host 1", 5.0, 4.0, 0, {"ann": {"good": 4}}, "camera 'C' seems off"),
            Result("failed", error="expected footage, found none", remedy="relink", remedy_fields={"session": "b"}),
        ),
        strict=True,
    ):
        claimed, held = manifest.claim_next()
        assert claimed == task
        assert manifest.finish(task, held, result)
    return plan


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--slurm", "--workers", "2"], "expected one of --slurm, --workers, found all of them"),
        (["--dask", "tcp://x", "--table"], "expected one of --table, --dask"),
        (["--workers", "0"], "expected --workers as a whole number from 1, found 0"),
        (["--table"], "expected the folder of a batch, found no tasks"),
        (["--check", "--slurm"], "expected one of --check, --slurm"),
        (["--report", "nowhere/morning.html"], "expected --report in a folder that exists, found none at nowhere"),
    ],
)
def test_wrong_words_are_a_sentence(run, plan, words, expected):
    assert_refused(run("batch", plan, *words), [expected])


@pytest.mark.parametrize(
    ("wanted", "n_tasks", "cores", "free", "n"),
    [
        (None, 40, 8, 64 * GB, 8),
        (16, 40, 8, 64 * GB, 16),
        (8, 3, 8, 64 * GB, 3),
        (8, 40, 8, 5 * GB, 2),
        (4, 9, 4, 1, 1),
    ],
)
def test_memory_bounds_the_workers_and_that_is_said(wanted, n_tasks, cores, free, n):
    found, note = n_workers(wanted, n_tasks, cores, free)
    assert found == n
    assert bool(note) == (n < min(wanted or cores, n_tasks))
    if note:
        assert f"{n} of {min(wanted or cores, n_tasks)} workers are started" in note


def test_the_scripts_of_a_job_array_are_shell_and_name_what_is_there(run, plan):
    out = output_of(run("batch", plan, "--slurm"))
    assert out.count("sbatch") == 3
    folder = plan.with_name("plan_batch")
    for name in ("kernels.sh", "array.sh", "merge.sh"):
        subprocess.run(["sh", "-n", str(folder / name)], check=True)
        assert os.access(folder / name, os.X_OK)
    assert "--array=0-1" in (folder / "array.sh").read_text()


@pytest.mark.parametrize("where", ["plan", "out", "session"])
def test_a_line_end_in_a_path_never_reaches_a_script(run, plan, where):
    odd = plan.parent / "odd\ntouch PWNED"
    words = ["--out", odd] if where == "out" else []
    if where == "plan":
        plan = plan.parent.rename(plan.parent.with_name("odd\ntouch PWNED")) / plan.name
    if where == "session":
        (plan.parent / "a").rename(odd)
        plan.write_text('sessions = ["*"]')
    status, out, err = run("batch", plan, *words, "--slurm")
    assert (status, out) == (1, "")
    assert "without line ends and other controls" in err
    assert "\ntouch" not in err
    assert [*plan.parent.parent.rglob("*.sh")] == []


def test_ended_work_is_not_checked(run, ended):
    for name in ("a", "b"):
        (ended.with_name(name) / "session.toml").unlink()
    assert run("batch", ended, "--slurm")[0] == 0
    assert "found 1 that cannot" in run("batch", ended, "--slurm", "--retry")[2]


def test_the_table_puts_failures_first_and_opens_at_the_worst_frame(run, ended):
    status, out, _ = run("batch", ended, "--table", "--json")
    assert status == 1
    report = json.loads(out)
    failed, done = report["recordings"]
    assert (failed["name"], done["name"]) == ("b", "a")
    assert failed["error"].startswith("expected footage, found none; ")
    assert "relink" in failed["error"]
    assert (done["poses"], done["contradiction"]) == (4, "camera 'C' seems off")
    assert report["totals"]["done"] == report["totals"]["failed"] == 1
    text = run("batch", ended, "--table")[1]
    assert "1 done, 1 failed" in text
    assert done["open"] in text


def test_a_verified_pose_counts_and_is_not_doubted(run, ended):
    folder = ended.with_name("a")
    store = AnnotationStore(folder / "annotations.sqlite")
    record = store.pose("ann", 1)
    store.commit("set", [PoseChange("ann", 1, replace(record, keyframe=True, status="lost"))])
    store.close()
    done = json.loads(run("batch", ended, "--table", "--json")[1])["recordings"][1]
    assert (done["verified"], done["share_doubted"]) == (1, 0.0)


def test_the_table_says_what_was_done_with_other_settings_than_the_plan_has(run, ended):
    before = json.loads(run("batch", ended, "--table", "--json")[1])["recordings"]
    assert [row["earlier"] for row in before] == ["", ""]
    ended.write_text('sessions = ["a", "b"]\nsettings = {stride = 2}')
    failed, done = json.loads(run("batch", ended, "--table", "--json")[1])["recordings"]
    assert "with earlier settings" in done["earlier"]
    assert failed["earlier"] == ""
    assert f"a: {done['earlier']}" in run("batch", ended, "--table")[1]
    ended.write_text('sessions = ["a"]')
    assert_refused(run("batch", ended, "--table"), ["expected the 2 recordings of the batch in", "found 1 others"])
    ended.unlink()
    assert run("batch", ended, "--table")[0] == 1  # without a plan, as it was run last


@pytest.mark.parametrize(
    ("file", "content", "words"),
    [
        ("results/000000.json", "", ["a: ", "results/000000.json is damaged", "--retry"]),
        ("results/000000.json", '{"state": "do', ["a: ", "results/000000.json is damaged", "--retry"]),
        ("results/000000.json", '{"state": "done", "remedy": 3}', ["a: ", "is damaged", "Expected `str`"]),
        ("results/000001.json", '{"state": "failed", "error": "x", "remedy": "of another version"}', ["b: x"]),
        ("stretches/000001.json", "[]", ["b: ", "stretches/000001.json is damaged"]),
        ("tasks/000000.json", None, ["task 000000: ", "expected the file of a task, found none", "with its plan"]),
        ("tasks/000001.json", None, ["task 000001: ", "expected the file of a task, found none"]),
        ("tasks/000000.json", "", ["task 000000: ", "tasks/000000.json is not valid JSON", "with its plan"]),
        ("tasks/000001.json", '{"recording": 3}', ["task 000001: ", "tasks/000001.json"]),
        ("tasks/notes.json", "", []),
    ],
)
def test_a_damaged_file_is_one_row_that_says_so(run, ended, file, content, words):
    folder = ended.with_name("plan_batch")
    manifest = Manifest.load(folder)
    before = {task.recording.name: manifest.result(task) for task in manifest.tasks}
    if file.startswith("stretches"):
        (folder / "results" / "000001.json").unlink()
    (folder / file).unlink(missing_ok=True)
    if content is not None:
        (folder / file).write_text(content)
    status, out, err = run("batch", ended, "--table")
    assert (status, err) == (1, "")
    assert len(out.splitlines()) <= 8
    assert all(word in out for word in words)
    damaged = Manifest.load(folder)
    assert len(damaged.tasks) == 2
    for task in damaged.tasks:  # each result is still that of its recording
        number = int(file[-6]) if file[-6].isdigit() else -1
        assert task.number == number or damaged.result(task) == before[task.recording.name]
    assert work(folder, do=lambda *_: pytest.fail("nothing is left to do")) == 0
    run("batch", ended, "--retry", "--slurm")
    counts = Manifest.load(folder).counts()
    assert counts["failed"] == 0
    assert counts["waiting"] == (1 if counts["done"] else 2)


def test_the_report_is_one_file_that_escapes_names(run, ended, tmp_path):
    run("batch", ended, "--table", "--report", tmp_path / "m.html")
    text = (tmp_path / "m.html").read_text()
    assert "quadrille open" in text
    assert "camera &#x27;C&#x27; seems off" in text
    assert "http" not in text


class FakeClient:
    """A client of Dask whose scheduler dies, or whose workers fail."""

    def __init__(self, address, timeout):
        self.status, self.future = "running", SimpleNamespace(status="error", exception=self.exception, done=bool)

    def nthreads(self):
        return {"worker": 1}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def exception(self):
        return ImportError("no module named tracker")


class LosesScheduler(FakeClient):
    def submit(self, *_, **__):
        self.status = "closed"
        raise RuntimeError("Client is closed. Can't send update-graph message.")


class LosesSchedulerLater(FakeClient):
    def submit(self, *_, **__):
        self.status, self.future.status = "closed", "cancelled"
        return self.future


class HasOtherWorkers(FakeClient):
    def submit(self, *_, **__):
        return self.future


@pytest.mark.parametrize(
    ("client", "words"),
    [
        (LosesScheduler, "expected the Dask scheduler at tcp://x until all recordings have ended, found it gone"),
        (LosesSchedulerLater, "expected the Dask scheduler at tcp://x until all recordings have ended, found it gone"),
        (HasOtherWorkers, "found one that fails with ImportError: no module named tracker"),
    ],
)
def test_a_cluster_that_fails_is_a_sentence(run, plan, monkeypatch, client, words):
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=client, KilledWorker=KeyError))
    monkeypatch.setattr("app.cli.batches.dask_cluster._LOOK_S", 0.0)
    assert_refused(run("batch", plan, "--dask", "tcp://x", "--json"), [words])


def test_workers_that_end_early_are_a_sentence_with_their_last_words(plan, run, monkeypatch):
    class Ended:
        def __init__(self, words, stdout, **_):
            stdout.write(b"begun\nquadrille: cannot write x: No space left on device\n")

        def poll(self):
            return 1

        kill = wait = terminate = poll
        __class_getitem__ = classmethod(lambda cls, _: cls)

    monkeypatch.setattr("app.cli.batches.local.subprocess.Popen", Ended)
    monkeypatch.setattr("app.cli.batches.local.compile_kernels", lambda progress: None)
    refused = run("batch", plan, "--json")
    assert_refused(refused, ["found none that said: quadrille: cannot write x: No space left", "run the batch again"])


def test_the_table_of_a_folder_that_cannot_be_written_is_shown(run, ended):
    with full_disk():
        assert "1 done, 1 failed" in run("batch", ended, "--table")[1]


def test_failed_tasks_are_tried_again_on_demand(run, ended):
    run("batch", ended, "--retry", "--slurm")
    manifest = Manifest.load(ended.with_name("plan_batch"))
    assert manifest.counts() == {"done": 1, "waiting": 1}
