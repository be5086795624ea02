"""The kernels are compiled beside the page by a program of its own, where they are not yet."""

import signal
import subprocess
import sys
import threading
import time

import numba
import pytest
from gestures import wait_for

from app.bench import compile_kernels
from app.control.session.kernel_warmup import KernelWarmup
from app.control.session.session_state import SessionState
from tracker.compute.kernel_cache import compiled_mark

WAITS = (sys.executable, "-c", "import time; time.sleep(100)")
FAILS = (sys.executable, "-c", "raise SystemExit(3)")


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """A folder for kernels in which there are none."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def screen(opened) -> SessionState:
    screen = opened()._session_state
    wait_for(lambda: screen.state.cost_px is not None)
    return screen


def test_the_page_is_told_until_all_is_compiled(screen, empty_cache):
    touches = f"import pathlib, time; time.sleep(0.5); pathlib.Path({str(compiled_mark())!r}).touch()"
    compiling = KernelWarmup(screen, (sys.executable, "-c", touches))
    assert screen.state.compiling
    wait_for(lambda: not screen.state.compiling)
    assert compiled_mark().exists()
    compiling.close()


def test_nothing_is_started_where_all_is_compiled(screen, empty_cache, monkeypatch):
    compiled_mark().touch()
    monkeypatch.setattr(subprocess, "Popen", pytest.fail)
    KernelWarmup(screen).close()
    assert not screen.state.compiling


def test_the_program_waits_for_the_first_cost(screen, empty_cache, monkeypatch):
    started = threading.Event()
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: started.set())
    with screen.lock:
        screen.set(cost_px=None)
    compiling = KernelWarmup(screen, WAITS)
    assert screen.state.compiling
    assert not started.wait(0.5)
    compiling.close()


def test_closing_ends_the_program(screen, empty_cache, caplog, monkeypatch):
    started = []
    real = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *a, **k: started.append(real(*a, **k)) or started[0])
    compiling = KernelWarmup(screen, WAITS)
    wait_for(lambda: started)
    compiling.close()
    assert started[0].returncode == -signal.SIGTERM
    wait_for(lambda: not screen.state.compiling)
    assert not caplog.records


def test_a_program_that_fails_is_reported_and_the_page_goes_on(screen, empty_cache, caplog):
    KernelWarmup(screen, FAILS)
    wait_for(lambda: not screen.state.compiling)
    assert "could not be compiled in the background" in caplog.text
    assert not compiled_mark().exists()


def test_one_program_compiles_at_a_time(empty_cache, monkeypatch):
    """The second finds all compiled once the first gives its lock back."""
    calls = []
    monkeypatch.setattr(compile_kernels, "_call_kernels", lambda: calls.append(1))
    with compile_kernels.SessionLock(empty_cache):
        monkeypatch.setattr(time, "sleep", lambda _: compiled_mark().touch())
        compile_kernels.main()
    assert not calls


def test_the_program_calls_the_kernels_and_marks_them_compiled(empty_cache, monkeypatch):
    """All of them, by tracking: those that two people need, the paper's search, and a room without a background."""
    tracked, priorities = [], []
    monkeypatch.setattr("os.nice", priorities.append)
    monkeypatch.setattr(
        compile_kernels, "_track", lambda cameras, settings, models, start: tracked.append((cameras, settings, models))
    )
    compile_kernels.main(background=True)
    assert priorities == [19]
    assert [(s.estimate, len(m), c[0].background is None) for c, s, m in tracked] == [
        ("refine", 2, False), ("search", 1, False), ("refine", 1, True)
    ]  # fmt: skip
    assert compiled_mark().exists()
