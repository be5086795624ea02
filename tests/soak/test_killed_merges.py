"""Random edits, undos and merges of two copies, killed at any write: no acknowledged edit is missing."""

import os
import random
import shutil
import signal
import sys
import time

import pytest
from annotated_copies import ACTIONS, FRAMES, act, add_tasks, new_store, pose, shown
from command_line import SAMPLE

from tracker.annotation.merge_sessions import merge_sessions
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

pytestmark = pytest.mark.slow

SEED, TOLERANCE_M = 16, 0.02
STORE = "annotations.sqlite"


def in_a_child(work):
    """Run a function in a forked process; returns the number of the process."""
    pid = os.fork()
    if pid:
        return pid
    try:
        work()
        os._exit(0)
    finally:
        os._exit(1)


def killed_at(folder, n_writes):
    """Kill this process before its n-th writing to a folder."""
    left = n_writes

    def hook(event, arguments):
        nonlocal left
        names = [str(a) for a in arguments[:2] if isinstance(a, str | bytes | os.PathLike)]
        is_write = event == "open" and len(arguments) > 2 and arguments[2] & (os.O_WRONLY | os.O_RDWR)
        is_change = event in ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "sqlite3.connect", "shutil.copyfile")
        if (is_write or is_change) and any(str(folder) in name for name in names):
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def end_of(pid):
    """Wait for a process; returns whether it ended by itself."""
    status = os.waitpid(pid, 0)[1]
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
    return not os.WIFSIGNALED(status)


def content(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def labels(folder):
    with AnnotationStore(folder / STORE, read_only=True) as store:
        return {edit.label for edit in store.read_log().edits}


@pytest.fixture
def copies(tmp_path):
    """Two copies of a session, in one folder."""
    a, b = tmp_path / "in" / "a", tmp_path / "in" / "b"
    shutil.copytree(SAMPLE, a)
    new_store(a / STORE).close()
    shutil.copytree(a, b)
    return a, b


def test_a_merge_that_is_killed_leaves_the_copies_and_a_whole_session_or_none(copies, tmp_path, report):
    rng = random.Random(SEED)
    for folder in copies:
        with AnnotationStore(folder / STORE, author=folder.name) as store:
            for _ in range(30):
                act(store, rng.randrange(ACTIONS), rng.choice(FRAMES), rng.randrange(10))
    merge_sessions(*copies, tmp_path / "whole", TOLERANCE_M)
    expected, before = shown(tmp_path / "whole" / STORE), content(tmp_path / "in")
    out = tmp_path / "out" / "merged"
    out.parent.mkdir()
    n_writes = 0
    while True:

        def merge(n=n_writes):
            killed_at(out.parent, n)
            merge_sessions(*copies, out, TOLERANCE_M)

        is_done = end_of(in_a_child(merge))
        assert content(tmp_path / "in") == before
        assert is_done <= out.exists()
        if out.exists():
            assert {p.name for p in out.iterdir()} == {p.name for p in (tmp_path / "whole").iterdir()}
            assert shown(out / STORE) == expected
            shutil.rmtree(out)
        if is_done:
            break
        n_writes += 1
    report(f"{n_writes} merges killed")
    assert n_writes > 5


def test_no_acknowledged_edit_is_missing_after_kills_and_merges(copies, tmp_path, cases, report):
    rng, acknowledged = random.Random(SEED), {folder: set() for folder in copies}
    n_edits, n_kills, n_merges, n_wanted = 0, 0, 0, max(100, cases(1000))
    while n_edits < n_wanted:
        folder = rng.choice(copies)
        seed = rng.randrange(10**9)
        reader, writer = os.pipe()

        def edit(folder=folder, seed=seed, writer=writer):
            own = random.Random(seed)
            store = AnnotationStore(folder / STORE, author=folder.name)
            for i in range(1000):
                frame, x = own.choice(FRAMES), own.randrange(10)
                if own.random() < 0.3:
                    act(store, own.choice((2, 3, 7)), frame, x)
                label = f"{seed}.{i}"
                store.commit(label, [PoseChange("ann", frame, pose(x, keyframe=x % 2 == 0))])
                os.write(writer, f"{label}\n".encode())

        pid = in_a_child(edit)
        os.close(writer)
        time.sleep(rng.uniform(0.01, 0.1))
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        n_kills += 1
        with open(reader, encoding="utf-8") as pipe:
            said = pipe.read().split()
        n_edits += len(said)
        acknowledged[folder] |= {*said}
        assert labels(folder) >= acknowledged[folder]  # which opens it with all checks
        if rng.random() < 0.5:
            merged, n_writes = tmp_path / "in" / "merged", rng.randrange(40)

            def merge(n=n_writes, merged=merged):
                killed_at(merged.parent, n)
                merge_sessions(*copies, merged, TOLERANCE_M)

            n_kills += not end_of(in_a_child(merge))
            if merged.exists():
                n_merges += 1
                both = set().union(*acknowledged.values())
                assert labels(merged) >= both
                shutil.rmtree(folder)
                merged.rename(folder)
                acknowledged[folder] = both
    with AnnotationStore(copies[0] / STORE) as store:
        add_tasks(store, [("ann", 9, "anna")])  # it can still be written
    report(f"{n_edits} edits, {n_kills} kills, {n_merges} merges")
    assert n_merges
