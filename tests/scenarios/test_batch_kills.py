"""Workers that track are killed at random times: nothing is lost, nothing is done again, and the poses are the same."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import SAMPLE

import quadrille
from tracker.batch.manifest import Manifest
from tracker.batch.plan import read_plan
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints

pytestmark = pytest.mark.slow
N_KILLS = 25
PLAN = """
sessions = ["r*", "long"]
settings = {acquire = false, frames = "0:4", attempts = 1000, options = {whole_run = false}}
[recordings.long]
frames = "0:16"
stretch = 5
"""
LONG = (0, 5, 10, 15)
"""Frames with keyframes, where the long recording is cut."""


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Eleven copies of the bundled sample with a first pose, and one with keyframes that is cut into stretches."""
    folder = tmp_path_factory.mktemp("batch")
    for name, frames in (("r00", (0,)), ("long", LONG)):
        session = quadrille.open_session(shutil.copytree(SAMPLE, folder / name))
        for frame in frames:
            joints = read_joints(SAMPLE / "truth.trc", session.fps)
            set_pose_at_joints(session, 0, frame, joints, fit_sizes=False)
    for i in range(1, 11):
        shutil.copytree(folder / "r00", folder / f"r{i:02d}")
    (folder / "plan.toml").write_text(PLAN)
    return folder


def lab_of(recordings, folder):
    """A copy of the recordings, and its batch."""
    lab = shutil.copytree(recordings, folder / "lab")
    return lab, Manifest.create(read_plan(lab / "plan.toml", lab / "out"), lab / "out")


def start(lab):
    words = [sys.executable, "-m", "quadrille", "batch", str(lab / "plan.toml"), "--out", str(lab / "out"), "--work"]
    log = (lab / "log.txt").open("ab")
    return subprocess.Popen(words, stdout=log, stderr=log, env={**os.environ, "QUADRILLE_THREADS": "1"})


def poses_of(lab):
    return {folder.name: quadrille.read_poses(folder).joints for folder in [*sorted(lab.glob("r*")), lab / "long"]}


def finish(lab, manifest, n_kills, life_s):
    """Finish a batch by two workers, one of which is killed so many times; return how often that was done, and the
    results as they were when they were seen first."""
    workers, done, seen = [], 0, {}
    while not manifest.is_finished():
        workers = [w for w in workers if w.poll() is None]
        while len(workers) < 2:
            workers.append(start(lab))
        for path in (manifest.folder / "results").glob("*.json"):
            seen.setdefault(path.name, path.read_bytes())
        time.sleep(random.uniform(0.1, 0.9) * life_s)
        if done < n_kills:
            random.choice(workers).send_signal(signal.SIGKILL)
            done += 1
    for worker in workers:
        worker.wait()
    return done, seen


def check(lab, manifest, seen, expected):
    """All is done, nothing was done again once it had ended, and the poses are the same to the bit."""
    assert manifest.counts() == {"done": 12}
    for task in manifest.tasks:
        result = manifest.folder / "results" / f"{task.key}.json"
        assert result.read_bytes() == seen.get(result.name, result.read_bytes())
        stored = max(p.stat().st_mtime for p in (lab / task.recording.name).glob("annotations.sqlite*"))
        assert stored <= result.stat().st_mtime
    assert not [*(manifest.folder / "claims").glob("[0-9]*")]
    assert not [p for p in (manifest.folder / "stretches").iterdir() if p.is_dir()]
    joined = json.loads((manifest.folder / "results" / "000000.json").read_text())
    assert (joined["n_stretches"], joined["seams"]) == (3, [])
    found = poses_of(lab)
    assert expected.keys() == found.keys()
    for name, joints in found.items():
        assert np.array_equal(joints, expected[name], equal_nan=True), name


def test_random_kills_of_workers_that_track(recordings, tmp_path):
    alone, manifest = lab_of(recordings, tmp_path / "alone")
    began = time.monotonic()
    worker = start(alone)
    while manifest.counts()["done"] == 0:
        time.sleep(0.1)
        assert worker.poll() is None
    life_s = time.monotonic() - began  # until the first task is done: kills come before and after
    assert worker.wait() == 0
    expected, n_left = poses_of(alone), N_KILLS
    random.seed(44)
    while n_left:
        lab, manifest = lab_of(recordings, tmp_path / f"killed{n_left}")
        n_kills, seen = finish(lab, manifest, n_left, life_s)
        check(lab, manifest, seen, expected)
        n_left -= n_kills
