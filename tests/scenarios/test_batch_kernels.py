"""Two hundred short tasks compile the kernels once, into a cache that is empty before."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest
from command_line import SAMPLE

import quadrille
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints
from tracker.session.session import save_session

pytestmark = pytest.mark.slow
N_TASKS = 200
PLAN = """
sessions = ["r*"]
settings = {acquire = false, frames = "0:2", options = {whole_run = false}}
"""


@pytest.fixture
def lab(tmp_path):
    """Two hundred sessions of the same footage with a first pose."""
    session = quadrille.open_session(SAMPLE)
    save_session(replace(session, folder=tmp_path / "r000"))  # with absolute paths of its footage
    first = quadrille.open_session(tmp_path / "r000")
    set_pose_at_joints(first, 0, 0, read_joints(SAMPLE / "truth.trc", first.fps), fit_sizes=False)
    for i in range(1, N_TASKS):
        shutil.copytree(tmp_path / "r000", tmp_path / f"r{i:03d}")
    (tmp_path / "plan.toml").write_text(PLAN)
    return tmp_path


def compiled(cache):
    """Each compiled kernel, by its file, with the time at which it was written."""
    return {path.name: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}


def test_two_hundred_short_tasks_compile_each_kernel_once(lab, tmp_path):
    cache = tmp_path / "kernels"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    words = [sys.executable, "-m", "quadrille", "batch", str(lab / "plan.toml"), "--workers", "2", "--json"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    report = json.loads(done.stdout)
    assert report["totals"]["done"] == N_TASKS
    kernels = compiled(cache)
    assert len(kernels) > 20
    began = min((lab / "plan_batch" / "attempts").iterdir(), key=lambda path: path.stat().st_mtime_ns)
    late = {name for name, time in kernels.items() if time > began.stat().st_mtime_ns}
    assert not late, "a worker compiled what the batch had compiled before its first task"
    cpu_s = sorted(r["cpu_seconds"] for r in report["recordings"])
    print(
        f"{len(kernels)} kernels; processor time of tasks: median {cpu_s[N_TASKS // 2]:.2f} s, most {cpu_s[-1]:.2f} s"
    )
