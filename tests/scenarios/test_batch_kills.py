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

import tracker
from tracker.batch.manifest import Manifest
from tracker.batch.plan import read_plan
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints

pytestmark = pytest.mark.slow
N_KILLS = 25
PLAN = """
sessions = ["r*", "long"]
settings = {acquire = false, frames = "0:4", attempts = 1000, options = {audit = false}}
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
        session = tracker.open_session(shutil.copytree(SAMPLE, folder / name))
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
    words = [sys.executable, "-m", "app", "batch", str(lab / "plan.toml"), "--out", str(lab / "out"), "--work"]
    log = (lab / "log.txt").open("ab")
    return subprocess.Popen(words, stdout=log, stderr=log, env={**os.environ, "QUADRILLE_THREADS": "1"})


def poses_of(lab):
    return {folder.name: tracker.read_poses(folder).joints for folder in [*sorted(lab.glob("r*")), lab / "long"]}


def test_random_kills_of_workers_that_track(recordings, tmp_path):
    alone, _ = lab_of(recordings, tmp_path / "alone")
    assert start(alone).wait() == 0
    random.seed(44)
    lab, manifest = lab_of(recordings, tmp_path / "killed")
    workers, n_kills, changed = [], 0, {}
    while not manifest.is_finished():
        workers = [w for w in workers if w.poll() is None]
        while len(workers) < 2:
            workers.append(start(lab))
        for task in manifest.tasks:
            if manifest.result(task) is not None and task.number not in changed:
                changed[task.number] = (manifest.folder / "results" / f"{task.key}.json").read_bytes()
        if n_kills < N_KILLS:
            time.sleep(random.uniform(0.3, 4.0))
            random.choice(workers).send_signal(signal.SIGKILL)
            n_kills += 1
        else:
            time.sleep(0.2)
    for worker in workers:
        worker.wait()
    assert n_kills >= N_KILLS or len(changed) >= len(manifest.tasks) - 1
    assert manifest.counts() == {"done": 12}
    for task in manifest.tasks:  # none was done again once it had ended
        result = manifest.folder / "results" / f"{task.key}.json"
        assert result.read_bytes() == changed.get(task.number, result.read_bytes())
        stored = max(p.stat().st_mtime for p in (lab / task.recording.name).glob("annotations.sqlite*"))
        assert stored <= result.stat().st_mtime
    assert not [*(manifest.folder / "claims").glob("[0-9]*")]
    assert not [p for p in (manifest.folder / "stretches").iterdir() if p.is_dir()]
    joined = json.loads((manifest.folder / "results" / "000000.json").read_text())
    assert (joined["n_stretches"], joined["seams"]) == (3, [])
    expected, found = poses_of(alone), poses_of(lab)
    assert expected.keys() == found.keys()
    for name, joints in found.items():
        assert np.array_equal(joints, expected[name], equal_nan=True), name
    print(f"{n_kills} kills")
