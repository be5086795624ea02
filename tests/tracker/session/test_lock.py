import json
import os
import socket
import subprocess
import sys
import textwrap

import pytest

from tracker.errors import SessionError
from tracker.session.lock import LOCK_FILE, SessionLock

HOLDER = textwrap.dedent("""
    import sys, time
    from tracker.session.lock import SessionLock
    SessionLock(sys.argv[1]).acquire()
    print("held", flush=True)
    time.sleep(60)
""")


@pytest.fixture
def other(tmp_path):
    """Another program that holds the lock."""
    process = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()


def test_second_program_is_told_who_holds_it(tmp_path, other):
    with pytest.raises(SessionError, match=rf"process {other.pid} on {socket.gethostname()} since 20\d\d-"):
        SessionLock(tmp_path).acquire()


def test_lock_of_a_killed_program_is_taken_over(tmp_path, other):
    other.kill()
    other.wait()
    with SessionLock(tmp_path):
        assert json.loads((tmp_path / LOCK_FILE).read_text())["process"] == os.getpid()
    assert list(tmp_path.iterdir()) == []


def test_twice_in_one_program(tmp_path):
    with SessionLock(tmp_path), pytest.raises(SessionError, match="in this program since"):
        SessionLock(tmp_path).acquire()


def test_free_again_after_release(tmp_path):
    for _ in range(2):
        with SessionLock(tmp_path):
            assert [p.name for p in tmp_path.iterdir()] == [LOCK_FILE]
        assert list(tmp_path.iterdir()) == []


def change(folder, **values):
    data = json.loads((folder / LOCK_FILE).read_text())
    (folder / LOCK_FILE).write_text(json.dumps(data | values))


def test_process_number_used_again_by_another_program(tmp_path):
    SessionLock(tmp_path).acquire()
    # init always runs, but did not start when the lock says its holder did.
    change(tmp_path, process=1, started="1234567890123")
    with SessionLock(tmp_path):
        pass


def test_other_machine_is_never_taken_for_dead(tmp_path):
    SessionLock(tmp_path).acquire()
    change(tmp_path, host="elsewhere", process=999_999_999)
    with pytest.raises(SessionError, match="on elsewhere since"):
        SessionLock(tmp_path).acquire()


def test_release_leaves_a_lock_that_was_taken_over(tmp_path):
    lock = SessionLock(tmp_path)
    lock.acquire()
    change(tmp_path, host="elsewhere", token="other")
    lock.release()
    assert (tmp_path / LOCK_FILE).exists()


ODD = ["7", 10**30, -1, 0, 2**31, 1.5, float("inf"), True, None, [[7]], {}, "x" * 20_000]


@pytest.mark.parametrize("process", ODD, ids=lambda p: str(p)[:9])
def test_lock_with_an_odd_process(tmp_path, process):
    """Such a number is never handed to the system, which would signal a group of processes or overflow."""
    SessionLock(tmp_path).acquire()
    change(tmp_path, process=process)
    with pytest.raises(SessionError, match="cannot be read"):
        SessionLock(tmp_path).acquire()


DAMAGED = [
    *(b"{", b"", b"7", b"null", b"\xff\xfe", b'{"process": 1e400}', bytes(20_000)),
    *(b"[" * 100_000, b"[" * 9_000, b'{"host":' * 1_200),
]


@pytest.mark.parametrize("data", DAMAGED, ids=lambda d: str(d[:9]))
def test_unreadable_lock(tmp_path, data):
    (tmp_path / LOCK_FILE).write_bytes(data)
    with pytest.raises(SessionError, match="cannot be read"):
        SessionLock(tmp_path).acquire()


def test_missing_folder(tmp_path):
    with pytest.raises(SessionError, match="cannot write"):
        SessionLock(tmp_path / "none").acquire()


def test_a_program_with_an_odd_name_has_a_start_time(tmp_path):
    """The kernel's list of processes has its name in whatever bytes it has."""
    odd = tmp_path / "sl\udceeep"
    odd.symlink_to("/bin/sleep")
    process = subprocess.Popen([os.fsencode(odd), "60"])
    try:
        SessionLock(tmp_path).acquire()
        change(tmp_path, process=process.pid, started="1")
        SessionLock(tmp_path).acquire()  # the number was used again: its start time was read
    finally:
        process.kill()
        process.wait()
