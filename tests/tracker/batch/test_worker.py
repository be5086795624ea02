"""Workers claim tasks, each once; a dead worker's task is taken again; one failure does not stop the others."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Thread

import batch_work
import msgspec
import pytest
from batch_work import make_batch, write_line
from full_disks import full_disk

from tracker.batch import claims
from tracker.batch.task_files import RecordingTask, Result
from tracker.batch.worker import work
from tracker.errors import TrackerError
from tracker.session.lock import LOCK_FILE, this_holder


@pytest.fixture
def manifest(tmp_path):
    """A batch of one task."""
    return make_batch(tmp_path, 1)


def gone(**changes):
    """A holder whose process has ended."""
    child = subprocess.Popen(["true"])
    child.wait()
    return msgspec.structs.replace(this_holder(), process=child.pid, started="1", **changes)


def test_one_failure_does_not_stop_the_others_and_can_be_tried_again(tmp_path):
    manifest = make_batch(tmp_path, 5, failing={2})
    assert work(tmp_path, do=write_line) == 5
    assert manifest.counts() == {"done": 4, "failed": 1}
    failed = manifest.result(manifest.tasks[2])
    assert failed.error == "expected a recording that works, found none; leave it out"
    assert work(tmp_path, do=write_line) == 0
    assert manifest.retry() == 1
    assert work(tmp_path, do=write_line) == 1


def test_an_internal_error_fails_its_recording_alone(tmp_path):
    manifest = make_batch(tmp_path, 2)

    def divide(task, folder, progress):
        return write_line(task, folder, progress) if task.number else 1 / 0

    work(tmp_path, do=divide)
    assert manifest.counts() == {"done": 1, "failed": 1}
    assert "ZeroDivisionError" in manifest.result(manifest.tasks[0]).error


def test_several_workers_do_each_task_once(tmp_path):
    manifest = make_batch(tmp_path, 40)
    threads = [Thread(target=work, args=(tmp_path, None, write_line)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert manifest.counts() == {"done": 40}
    assert [(tmp_path / f"{t.key}.txt").read_text() for t in manifest.tasks] == ["done\n"] * 40


def test_a_task_waits_for_those_before_it_even_if_they_fail(tmp_path):
    manifest = make_batch(tmp_path, 2, failing={0})
    manifest.tasks = (manifest.tasks[0], RecordingTask(1, manifest.tasks[1].recording, after=(0,)))
    first, held = manifest.claim_next()
    assert first.number == 0
    assert manifest.claim_next() is None
    manifest.finish(first, held, Result("failed", error="x"))
    assert manifest.claim_next()[0].number == 1


def test_the_task_of_a_dead_worker_is_taken_again_with_its_session(tmp_path, manifest):
    dead = gone()
    (tmp_path / "claims" / "000000").write_bytes(msgspec.json.encode(dead))
    session = Path(manifest.tasks[0].recording.session)
    session.mkdir()
    (session / LOCK_FILE).write_bytes(msgspec.json.encode(msgspec.structs.replace(dead, token="session")))
    assert manifest.state(manifest.tasks[0]) == "waiting"
    task, held = manifest.claim_next()
    held.free_session(session)
    assert not (session / LOCK_FILE).exists()
    assert manifest.state(task) == "running"
    assert manifest.claim_next() is None


def test_a_worker_of_another_machine_is_dead_without_signs_of_life(tmp_path, manifest):
    path = tmp_path / "claims" / "000000"
    path.write_bytes(msgspec.json.encode(msgspec.structs.replace(this_holder(), host="elsewhere")))
    assert manifest.claim_next() is None
    past = time.time() - claims.DEAD_S - 1
    os.utime(path, (past, past))
    assert manifest.claim_next() is not None


@pytest.mark.parametrize(
    "content", [b"", msgspec.json.encode(msgspec.structs.replace(this_holder(), host="elsewhere"))]
)
def test_a_claim_with_a_time_to_come_is_of_a_dead_worker(tmp_path, content, manifest):
    path = tmp_path / "claims" / "000000"
    path.write_bytes(content)
    future = time.time() + 30 * 86400
    os.utime(path, (future, future))
    assert manifest.state(manifest.tasks[0]) == "waiting"
    assert manifest.claim_next() is not None


def test_a_clock_that_differs_from_that_of_the_folder_counts_nothing(tmp_path, monkeypatch, manifest):
    (tmp_path / "claims" / "000000").write_bytes(
        msgspec.json.encode(msgspec.structs.replace(this_holder(), host="elsewhere"))
    )
    monkeypatch.setattr(claims.time, "time", lambda: 0.0)
    assert manifest.state(manifest.tasks[0]) == "running"


def test_a_full_disk_leaves_no_claim_without_its_holder(tmp_path, manifest):
    with full_disk(), pytest.raises(OSError, match="File too large"):
        manifest.claim_next()
    assert [*(tmp_path / "claims").iterdir()] == []
    assert manifest.claim_next() is not None


def test_a_result_that_cannot_be_written_is_a_sentence(tmp_path, manifest):

    def do(task, folder, progress):
        resource = full_disk()
        resource.__enter__()
        unlimited.append(resource)
        return write_line(task, folder, progress)

    unlimited = []
    try:
        with pytest.raises(TrackerError, match=r"cannot write .*000000.json: File too large; choose a folder"):
            work(tmp_path, do=do)
    finally:
        unlimited[0].__exit__(None, None, None)
    assert manifest.result(manifest.tasks[0]) is None


def test_the_lock_of_somebody_else_stays(tmp_path, manifest):
    (tmp_path / "claims" / "000000").write_bytes(msgspec.json.encode(gone()))
    session = Path(manifest.tasks[0].recording.session)
    session.mkdir()
    (session / LOCK_FILE).write_bytes(msgspec.json.encode(this_holder()))
    _, held = manifest.claim_next()
    held.free_session(session)
    assert (session / LOCK_FILE).exists()


def test_a_worker_without_its_claim_writes_no_result(manifest):
    task, held = manifest.claim_next()
    held.path.write_bytes(msgspec.json.encode(this_holder()))
    assert not manifest.finish(task, held, Result("done"))
    assert manifest.result(task) is None


def test_signs_of_life_are_shown(monkeypatch, manifest):
    monkeypatch.setattr(claims, "BEAT_S", 0.01)
    _, held = manifest.claim_next()
    os.utime(held.path, (0, 0))
    with held.beating():
        time.sleep(0.1)
    assert held.path.stat().st_mtime > 1


def test_a_task_that_kills_its_workers_fails_at_last(tmp_path, manifest):
    for _ in range(3):
        manifest.count_attempt(manifest.tasks[0])
    work(tmp_path, do=write_line)
    assert "3 workers died" in manifest.result(manifest.tasks[0]).error


def test_a_worker_that_is_stopped_gives_its_task_back(tmp_path):
    manifest, asked = make_batch(tmp_path, 1), []

    def is_stopped():
        asked.append(1)
        return len(asked) > 1

    assert work(tmp_path, do=write_line, is_stopped=is_stopped) == 0
    assert manifest.state(manifest.tasks[0]) == "waiting"
    work(tmp_path, do=write_line)
    assert manifest.result(manifest.tasks[0]).state == "done"


@pytest.mark.slow
def test_a_hundred_kills_lose_nothing_and_do_nothing_twice(tmp_path):
    random.seed(17)
    manifest = make_batch(tmp_path, 60)
    words = [sys.executable, batch_work.__file__, str(tmp_path)]
    n_kills, workers = 0, []
    while not manifest.is_finished():
        workers = [w for w in workers if w.poll() is None]
        while len(workers) < 2:
            workers.append(subprocess.Popen(words))
        if n_kills < 100:
            time.sleep(random.uniform(0.8, 1.6))
            random.choice(workers).send_signal(signal.SIGKILL)
            n_kills += 1
            for task in manifest.tasks:  # a kill is not the task's fault
                (tmp_path / "attempts" / task.key).unlink(missing_ok=True)
        else:
            time.sleep(0.1)
    for worker in workers:
        worker.kill()
        worker.wait()
    assert manifest.counts() == {"done": 60}
    written = [(tmp_path / f"{t.key}.txt").read_text() for t in manifest.tasks]
    assert all(text.startswith("done\n") for text in written)
