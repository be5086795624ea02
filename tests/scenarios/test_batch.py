"""Twelve recordings of which two are broken, by local workers, a cluster with a killed worker, and a job array."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import SAMPLE

import quadrille
from tracker.compute.kernel_cache import compiled_mark
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints

pytestmark = pytest.mark.slow
QUADRILLE = [sys.executable, "-m", "quadrille"]
PLAN = """
sessions = ["r*"]
settings = {acquire = false, frames = "0:4", export = ["csv"], options = {whole_run = false}}
"""


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Ten copies of the bundled sample with a first pose, one whose footage is no video, and one with a damaged store.

    The check before the batch finds neither.
    """
    folder = tmp_path_factory.mktemp("batch")
    first = shutil.copytree(SAMPLE, folder / "r00")
    session = quadrille.open_session(first)
    set_pose_at_joints(session, 0, 0, read_joints(SAMPLE / "truth.trc", session.fps), fit_sizes=False)
    for i in range(1, 12):
        shutil.copytree(first, folder / f"r{i:02d}")
    for file in (folder / "r03").glob("*.mp4"):
        file.write_text("no video")
    (folder / "r07" / "annotations.sqlite").write_text("no store")
    (folder / "plan.toml").write_text(PLAN)
    return folder


@pytest.fixture
def lab(recordings, tmp_path):
    return shutil.copytree(recordings, tmp_path / "lab")


def batch(lab, *words):
    done = subprocess.run(
        [*QUADRILLE, "batch", str(lab / "plan.toml"), *words, "--json"], capture_output=True, text=True
    )
    return done.returncode, json.loads(done.stdout)


def poses_of(lab):
    """Joints of each recording that was tracked."""
    folders = [folder for folder in sorted(lab.glob("r*")) if folder.name not in ("r03", "r07")]
    return {folder.name: quadrille.read_poses(folder).joints for folder in folders}


@pytest.fixture(scope="module")
def expected(recordings, tmp_path_factory):
    """Poses by one local worker."""
    lab = shutil.copytree(recordings, tmp_path_factory.mktemp("one") / "lab")
    status, found = batch(lab, "--workers", "1")
    assert status == 1
    assert found["totals"]["done"] == 10
    return poses_of(lab)


def kernels():
    """Names and times of the compiled kernels in the cache of this account."""
    folder = compiled_mark().parent
    return {p.name: p.stat().st_mtime_ns for p in folder.glob("*.nb?")}


def check(lab, found, expected):
    """Ten done, two explained, the same poses to the bit, and every recording tracked once."""
    assert (found["totals"]["done"], found["totals"]["failed"]) == (10, 2)
    failed = {r["name"]: r["error"] for r in found["recordings"] if r["state"] == "failed"}
    assert set(failed) == {"r03", "r07"}
    assert ".mp4" in failed["r03"]
    assert "annotations" in failed["r07"]
    poses = poses_of(lab)
    assert poses.keys() == expected.keys()
    for name, joints in poses.items():
        assert np.array_equal(joints, expected[name], equal_nan=True)
    log = [*(lab / "plan_batch" / "results").glob("*.json")]
    assert len(log) == 12


def test_local_workers(lab, expected):
    status, found = batch(lab, "--workers", "2", "--report", str(lab / "morning.html"))
    assert status == 1
    check(lab, found, expected)
    assert "quadrille open" in (lab / "morning.html").read_text()


def test_a_job_array_by_a_stand_in_for_the_scheduler(lab, expected):
    done = subprocess.run([*QUADRILLE, "batch", str(lab / "plan.toml"), "--slurm"], capture_output=True, text=True)
    assert "sbatch --parsable" in done.stdout
    folder = lab / "plan_batch"
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    # The stand-in gives the kernels that this machine has instead of compiling them into the folder.
    script = "\n".join(x for x in (folder / "array.sh").read_text().splitlines() if "NUMBA_CACHE_DIR" not in x)
    (folder / "array.sh").write_text(script)
    jobs = [
        subprocess.Popen(["sh", str(folder / "array.sh")], env={**environment, "SLURM_ARRAY_TASK_ID": str(i)})
        for i in range(2)
    ]
    assert [job.wait() for job in jobs] == [0, 0]
    assert subprocess.run(["sh", str(folder / "merge.sh")], capture_output=True).returncode == 1
    assert (folder / "morning.html").is_file()
    check(lab, batch(lab, "--table")[1], expected)


def test_a_cluster_of_which_a_worker_is_killed(lab, expected):
    pytest.importorskip("distributed", reason="needs quadrille[dask]")
    address = "tcp://127.0.0.1:28786"
    script = "from distributed.cli.dask_{} import main; main()"
    words = {"scheduler": ["--host", "127.0.0.1", "--port", "28786", "--no-dashboard"]}
    words["worker"] = [
        address,
        "--nworkers",
        "1",
        "--nthreads",
        "1",
        "--no-dashboard",
        "--no-nanny",
        "--host",
        "127.0.0.1",
    ]

    def start(kind):
        return subprocess.Popen([sys.executable, "-c", script.format(kind), *words[kind]], cwd=lab)

    scheduler = start("scheduler")
    time.sleep(3)
    workers = [start("worker"), start("worker")]
    running = subprocess.Popen(
        [*QUADRILLE, "batch", str(lab / "plan.toml"), "--dask", address, "--json"], stdout=subprocess.PIPE, text=True
    )
    try:
        results = lab / "plan_batch" / "results"
        while not results.is_dir() or len([*results.glob("*.json")]) < 4:
            time.sleep(0.2)
            assert running.poll() is None
        workers[0].send_signal(signal.SIGKILL)
        out, _ = running.communicate(timeout=500)
    finally:
        for process in (running, *workers, scheduler):
            process.kill()
            process.wait()
    check(lab, json.loads(out), expected)


def test_kernels_are_compiled_by_no_worker(lab, expected):
    """All workers load what one program has compiled: none adds a file to the cache."""
    before = kernels()
    assert batch(lab, "--workers", "2")[1]["totals"]["done"] == 10
    assert before
    assert kernels() == before
