"""The kernels are compiled beside the page by a program of its own, where they are not yet."""

import os
import signal
import sys
import time

import numpy as np
import pytest
from gestures import wait_for

from app.bench import compile_kernels
from app.drawing import joint_handles, overlays
from app.runtime import kernel_compiler
from app.runtime.kernel_compiler import KernelCompiler
from app.session.samples import bundled
from app.state.page_view import View
from tracker.compute import kernel_cache
from tracker.compute.kernel_cache import STAGES, compiled_mark, compiled_stages, record_compiled, record_stage
from tracker.compute.uncompiled_kernels import is_interpreted
from tracker.estimation.initialization.generators import silhouette_overlap
from tracker.estimation.voxel import labels
from tracker.evidence.voxels import carving
from tracker.session.session import load_session

VIEW = View(frozenset({"contours"}), (1, 0, 0, 0))
"""The contours of one camera."""
WAITS = (sys.executable, "-c", "import time; time.sleep(100)")
FAILS = (sys.executable, "-c", "raise SystemExit(3)")
WITH_CHILD = (
    sys.executable,
    "-c",
    "import subprocess, sys, time; c = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(100)']);"
    "print(c.pid, file=open(sys.argv[1], 'w'), flush=True); time.sleep(100)",
)


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """A folder for kernels in which there are none."""
    monkeypatch.setattr(kernel_cache, "_folder", lambda: tmp_path)
    return tmp_path


@pytest.fixture
def compiling(opened, empty_cache):
    """A controller beside a program that compiles nothing by itself."""
    compiler = KernelCompiler(WAITS)
    controller = opened(compiler=compiler)
    yield controller
    controller.close()


def test_the_page_shows_each_thing_once_its_kernels_are_compiled(compiling):
    state = compiling.session_state
    assert state.state.compiling == "posing"
    assert compiling.frames.cached_evidence(0) is None
    for stage in ("posing", "contours"):
        record_stage(stage)
    wait_for(lambda: state.state.compiling == "evidence")
    assert compiling.frames.cached_evidence(0) is None
    record_stage("evidence")
    wait_for(lambda: compiling.frames.cached_evidence(0) is not None)
    wait_for(lambda: state.state.cost_px is not None)  # interpreted
    assert state.state.compiling == "cost"
    interpreted_px = state.state.cost_px
    record_stage("cost")
    wait_for(lambda: state.state.compiling == "tracking")
    assert state.state.cost_px == pytest.approx(interpreted_px, rel=1e-4)
    record_compiled()
    wait_for(lambda: state.state.compiling is None)


def test_a_drag_before_all_kernels_moves_a_skeleton_without_cost(compiling):
    state = compiling.state
    handles = joint_handles.handles(compiling.session, state, {0})
    assert all(h.visible for h in handles)
    (skeleton,) = overlays.paths(compiling.session, state, VIEW, None)
    by_name = {h.point: (h.u, h.v) for h in handles}
    bones = [(*by_name[a], *by_name[b]) for a, b in compiling.models[0].bones]
    np.testing.assert_allclose(skeleton.segments_px, bones, atol=1e-3)
    before = state.people[0].values
    wrist = by_name["left_wrist"]
    compiling.dragging.begin(1, 0, 0, "left_wrist", wrist)
    compiling.dragging.move(1, (wrist[0] + 10, wrist[1]), 1)
    compiling.dragging.end(1)
    assert not np.array_equal(compiling.state.people[0].values, before)
    assert compiling.state.cost_px is None


def test_nothing_is_started_where_all_is_compiled(opened, empty_cache, monkeypatch):
    compiled_mark().touch()
    kernel_cache._keys_file().touch()
    monkeypatch.setattr(kernel_compiler.subprocess, "Popen", pytest.fail)
    assert KernelCompiler().stages == frozenset(STAGES)


@pytest.mark.slow
def test_closing_ends_the_program_and_what_it_started(empty_cache):
    file = empty_cache / "child"
    compiler = KernelCompiler((*WITH_CHILD, str(file)))
    wait_for(lambda: file.exists() and file.read_text().strip())
    child = int(file.read_text())
    compiler.close()
    assert compiler._process.returncode == -signal.SIGTERM

    def is_gone():
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return True
        with open(f"/proc/{child}/stat") as stat:  # a container may have nobody who reaps it
            return stat.read().rsplit(")", 1)[1].split()[0] == "Z"

    wait_for(is_gone)


def test_bodies_are_placed_by_interpreted_kernels_until_these_are_compiled(empty_cache):
    compiler = KernelCompiler(WAITS)
    assert is_interpreted("tracker.body.kinematics")
    assert not is_interpreted("tracker.evidence.images.edges")
    assert compiler.follow() == frozenset()
    assert is_interpreted("tracker.body.kinematics")
    record_stage("posing")
    assert compiler.follow() == {"posing"}
    assert not is_interpreted("tracker.body.kinematics")
    compiler.close()


@pytest.mark.parametrize("end", [KernelCompiler.close, lambda compiler: wait_for(compiler.follow)])
def test_nothing_is_interpreted_after_the_program(empty_cache, end):
    end(KernelCompiler(FAILS))
    assert not is_interpreted("tracker.body.kinematics")


def test_a_program_that_fails_is_reported_and_the_page_goes_on(opened, empty_cache, caplog):
    controller = opened(compiler=KernelCompiler(FAILS))
    wait_for(lambda: controller.state.compiling is None)
    wait_for(lambda: "could not be compiled in the background" in caplog.text)
    wait_for(lambda: controller.state.cost_px is not None)
    assert not compiled_mark().exists()


def test_one_program_compiles_at_a_time(empty_cache, monkeypatch):
    """The second finds all compiled once the first gives its lock back."""
    calls = []
    monkeypatch.setattr(compile_kernels, "_call_kernels", calls.append)
    with compile_kernels.SessionLock(empty_cache):
        monkeypatch.setattr(time, "sleep", lambda _: compiled_mark().touch())
        compile_kernels.main()
    assert not calls


def test_the_program_calls_the_kernels_and_marks_them_compiled(empty_cache, monkeypatch):
    """All of them, by tracking: those that two people need, the paper's search, and a room without a background."""
    tracked, priorities, stages, waited_for, beside = [], [], [], [], []
    monkeypatch.setattr("os.nice", priorities.append)

    class Beside:
        exitcode = 0

        def join(self):
            beside.append("joined")

    def start_child(work, *arguments):
        beside.append("started")
        work(*arguments)
        return Beside()

    monkeypatch.setattr(compile_kernels, "start_child", start_child)
    monkeypatch.setattr(compile_kernels, "record_stage", lambda stage: stages.append(stage) or record_stage(stage))
    monkeypatch.setattr(
        compile_kernels, "_track", lambda cameras, settings, models, start: tracked.append((cameras, settings, models))
    )
    monkeypatch.setattr(compile_kernels, "_call_others", lambda _: waited_for.extend(stages))
    compile_kernels.main(background=True)
    assert priorities == [19, 19]  # of the program, and of the process beside it after the evidence
    assert beside == ["started", "joined"]
    assert sorted(stages) == sorted(waited_for) == sorted(STAGES)  # no stage waits for other kernels
    assert [(s.estimate, len(m), c[0].background is None) for c, s, m in tracked] == [
        ("refine", 2, False), ("search", 1, False), ("refine", 1, True)
    ]  # fmt: skip
    assert compiled_mark().exists()
    assert compiled_stages() == frozenset(STAGES)
    assert not list(empty_cache.glob("stage-*"))


@pytest.mark.slow
def test_kernels_that_find_people_and_track_voxels_are_called_too(monkeypatch):
    called = []
    for module, name in ((carving, "carve_blocks"), (labels, "label_and_sum"), (silhouette_overlap, "_add")):
        kernel = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *args, kernel=kernel, name=name: called.append(name) or kernel(*args))
    compile_kernels._call_others(load_session(bundled("tango")))
    assert called == ["carve_blocks", "label_and_sum", "_add"]
