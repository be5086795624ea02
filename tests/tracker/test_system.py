"""Systems differ in one module; what it offers holds here on the ways of Linux and on those of all systems."""

import os
import re
import subprocess
import sys

import pytest
from architecture import FILES

from tracker import system

OF_ONE_SYSTEM = re.compile(
    r"\b(?:fcntl|msvcrt|psutil|ctypes|AF_UNIX|O_(?:NOFOLLOW|NONBLOCK|BINARY|CLOEXEC)|SIG(?:HUP|BREAK|KILL|CHLD)|killpg"
    r"|start_new_session|creationflags|getuid|geteuid|sched_getaffinity|setrlimit|os\.nice|os\.fork|os\.kill)\b"
    r'|get_context\("fork"\)|/proc/|sys\.platform|os\.name\b'
)
BOTH = pytest.mark.parametrize("is_linux", [system._IS_LINUX, False])


def test_no_other_module_names_what_one_system_has():
    found = {name: OF_ONE_SYSTEM.findall(path.read_text("utf-8")) for name, path in FILES.items()}
    assert {name for name, calls in found.items() if calls} == {"tracker.system"}


@BOTH
def test_a_process_runs_until_it_ends_and_its_number_is_not_another_one(monkeypatch, is_linux):
    monkeypatch.setattr(system, "_IS_LINUX", is_linux)
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    started = system.start_of(child.pid)
    assert started == system.start_of(child.pid) != ""
    assert system.is_running(child.pid, started)
    assert system.is_running(child.pid, "")
    assert not system.is_running(child.pid, started + "1")
    child.stdin.close()
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)  # ended, and nobody has asked for its status
    assert not system.is_running(child.pid, started)
    child.wait()
    assert not system.is_running(child.pid, started)
    assert system.start_of(child.pid) == ""


def test_a_program_apart_ends_with_all_that_it_has_started():
    wait = "import sys; sys.stdin.read()"
    starts_another = (
        f"import subprocess as s, sys; print(s.Popen([sys.executable, '-c', '{wait}']).pid, flush=True); {wait}"
    )
    process = system.start_detached(
        [sys.executable, "-c", starts_another], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    child = int(process.stdout.readline())
    system.end_apart(process)
    assert process.poll() is not None
    assert not system.is_running(child, "")


def test_an_open_file_is_locked_for_one_program(tmp_path):
    path = tmp_path / "lock"
    path.write_text("held")
    with path.open("rb+") as ours, path.open("rb+") as theirs:
        assert system.lock_at_once(ours.fileno())
        assert not system.lock_at_once(theirs.fileno())
    with path.open("rb+") as file:
        assert system.lock_at_once(file.fileno())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps a user's own folders private")
def test_a_file_that_others_may_read_is_not_private(tmp_path):
    path = tmp_path / "token"
    path.touch(0o600)
    assert system.is_private(path.stat())
    path.chmod(0o644)
    assert system.is_mine(path.stat())
    assert not system.is_private(path.stat())


def test_memory_and_cores_are_those_of_the_machine():
    assert 1 << 20 < system.free_bytes() < 1 << 50
    assert 1 <= system.n_cores() <= os.cpu_count()
