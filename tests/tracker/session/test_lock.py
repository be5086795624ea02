import errno
import json
import os
import socket
import subprocess
import sys
import textwrap
from contextlib import suppress
from itertools import combinations

import msgspec
import pytest

from tracker import system
from tracker.errors import SessionError
from tracker.session import lock as holder_module
from tracker.session import lock as lock_module
from tracker.session.lock import LOCK_FILE, SessionLock, is_held_here

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
def test_lock_with_an_odd_process(tmp_path, process, monkeypatch):
    """Such a number is never handed to the system, which would signal a group of processes or overflow."""
    monkeypatch.setattr(lock_module, "_WRITING_S", 0.1)
    SessionLock(tmp_path).acquire()
    change(tmp_path, process=process)
    with pytest.raises(SessionError, match="cannot be read"):
        SessionLock(tmp_path).acquire()


DAMAGED = [
    *(b"{", b"7", b"null", b"\xff\xfe", b'{"process": 1e400}', b"\n" * 20_000, bytes(20_000) + b"1"),
    *(b"[" * 100_000, b"[" * 9_000, b'{"host":' * 1_200),
]


@pytest.mark.parametrize("data", DAMAGED, ids=lambda d: str(d[:9]))
def test_unreadable_lock(tmp_path, data, monkeypatch):
    monkeypatch.setattr(lock_module, "_WRITING_S", 0.1)
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


# --- locks without content --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("data", [b"", bytes(200)], ids=["empty", "zeros"])
def test_a_lock_that_a_full_disk_left_without_content_is_taken_over(tmp_path, data, monkeypatch):
    monkeypatch.setattr(lock_module, "_WRITING_S", 0.1)
    (tmp_path / LOCK_FILE).write_bytes(data)
    with SessionLock(tmp_path):
        assert json.loads((tmp_path / LOCK_FILE).read_text())["process"] == os.getpid()
    assert list(tmp_path.iterdir()) == []


def test_a_lock_that_is_being_written_is_waited_for(tmp_path, monkeypatch):
    """Older programs, and drives without hard links, create the file before they write it."""
    SessionLock(tmp_path).acquire()
    text = (tmp_path / LOCK_FILE).read_text()
    (tmp_path / LOCK_FILE).write_bytes(b"")
    monkeypatch.setattr(lock_module.time, "sleep", lambda _: (tmp_path / LOCK_FILE).write_text(text))
    with pytest.raises(SessionError, match="in this program since"):
        SessionLock(tmp_path).acquire()


FULL = textwrap.dedent("""
    import os, resource, sys
    from tracker.errors import SessionError
    from tracker.session.lock import SessionLock
    if sys.argv[2] == "no links":
        def refused(*_):
            raise PermissionError(1, "Operation not permitted")
        os.link = refused
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
    try:
        SessionLock(sys.argv[1]).acquire()
    except SessionError as error:
        print(error)
""")


@pytest.mark.parametrize("drive", ["links", "no links"])
def test_a_disk_without_room_is_left_without_a_lock(tmp_path, drive):
    """The limit of the size of a file stands for a full disk."""
    words = [sys.executable, "-c", FULL, str(tmp_path), drive]
    said = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert "cannot write" in said.stdout, said.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_drive_without_hard_links(tmp_path, monkeypatch):
    def refused(*_):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", refused)
    with SessionLock(tmp_path):
        assert [p.name for p in tmp_path.iterdir()] == [LOCK_FILE]
        with pytest.raises(SessionError, match="in this program since"):
            SessionLock(tmp_path).acquire()
    assert list(tmp_path.iterdir()) == []


def test_a_named_pipe_in_place_of_the_lock_does_not_hang_the_program(tmp_path):
    os.mkfifo(tmp_path / LOCK_FILE)
    with pytest.raises(SessionError, match=r"its lock .* cannot be read"):
        SessionLock(tmp_path).acquire()


def test_a_program_knows_its_own_locks(tmp_path, other):
    assert not is_held_here(tmp_path)
    folder = tmp_path / "mine"
    folder.mkdir()
    with SessionLock(folder):
        assert is_held_here(folder)
    assert not is_held_here(folder)


# --- containers and machines of one name ------------------------------------------------------------------------------

GONE = 2**22 + 1
"""A number above the largest of a process (4,194,304 on Linux)."""


def left_by(tmp_path, **values):
    """A lock of a process that does not exist here."""
    SessionLock(tmp_path).acquire()
    change(tmp_path, process=GONE, **values)


def test_a_container_with_the_same_host_name_does_not_steal_the_lock(tmp_path):
    left_by(tmp_path, namespace="pid:[4026532000]")
    ways_out = "in another container; close it there, or delete .* if that container has ended"
    with pytest.raises(SessionError, match=f"in process {GONE} on .*, {ways_out}"):
        SessionLock(tmp_path).acquire()


def test_a_process_that_nobody_has_asked_for_its_status_is_dead():
    child = subprocess.Popen([sys.executable, "-c", "pass"])
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    holder = msgspec.structs.replace(holder_module.this_holder(), process=child.pid, started=system.start_of(child.pid))
    assert not holder_module.is_alive(holder)
    child.wait()


def test_another_machine_with_the_same_host_name_does_not_steal_the_lock(tmp_path):
    left_by(tmp_path, boot="4f0c3f9e-0000-4000-8000-000000000000", machine="another")
    with pytest.raises(SessionError, match=f"in process {GONE} on"):
        SessionLock(tmp_path).acquire()


@pytest.mark.parametrize(("namespace", "is_free"), [("pid:[4026531836]", True), ("pid:[4026532000]", False)])
def test_after_a_power_cut_the_lock_of_this_machine_is_free_but_not_that_of_a_container(
    tmp_path, monkeypatch, namespace, is_free
):
    here = holder_module.System(socket.gethostname(), "now", namespace, "laptop")
    monkeypatch.setattr(holder_module, "this_system", lambda: here)
    monkeypatch.setattr(lock_module, "this_system", lambda: here)
    left_by(tmp_path, boot="before", namespace=namespace, machine="laptop")
    if is_free:
        SessionLock(tmp_path).acquire()
    else:
        with pytest.raises(SessionError, match=r"from before this system was started, .* delete .*lock\.json if it is"):
            SessionLock(tmp_path).acquire()


def test_a_lock_of_an_older_program_is_known_by_its_host_name(tmp_path):
    left_by(tmp_path)
    data = json.loads((tmp_path / LOCK_FILE).read_text())
    (tmp_path / LOCK_FILE).write_text(
        json.dumps({k: data[k] for k in ("host", "process", "started", "since", "token")})
    )
    with SessionLock(tmp_path):
        pass


# --- races ------------------------------------------------------------------------------------------------------------


class Meanwhile:
    """Lets other programs act between the steps of one: before each call that concerns a lock file."""

    def __init__(self):
        self.actions, self.step = {}, None
        sys.addaudithook(self._hear)

    def _hear(self, event, args):
        is_step = event in ("open", "os.rename", "os.remove", "os.link") and any(LOCK_FILE in str(a) for a in args)
        if not is_step or self.step is None:
            return
        action, at, self.step = self.actions.get(self.step), self.step, None
        if action is not None:
            action()
        self.step = at + 1

    def run(self, work, actions):
        """Run some work with actions before its steps, by number; returns how many steps it took."""
        self.actions, self.step = actions, 0
        try:
            work()
            return self.step
        finally:
            self.step = None


def takes(lock):
    with suppress(SessionError):
        lock.acquire()


def test_of_three_programs_that_race_for_a_stale_lock_one_holds_it(tmp_path, monkeypatch):
    """Every schedule of two programs that take the lock at once, between any two steps of a third."""
    monkeypatch.setattr(lock_module, "_WRITING_S", 0.01)
    left_by(tmp_path)
    meanwhile, found = Meanwhile(), []
    n_steps = meanwhile.run(lambda: takes(SessionLock(tmp_path)), {})
    assert n_steps >= 4
    for first, second in combinations(range(n_steps + 3), 2):  # the others may make the third take more steps
        folder = tmp_path / f"{first} {second}"
        folder.mkdir()
        left_by(folder)
        locks = [SessionLock(folder) for _ in range(3)]
        meanwhile.run(
            lambda: takes(locks[0]),  # noqa: B023
            {first: lambda: takes(locks[1]), second: lambda: takes(locks[2])},  # noqa: B023
        )
        holders = [i for i, lock in enumerate(locks) if lock._held is not None]
        found += [(first, second, holders)] if len(holders) != 1 else []
    assert found == []
