"""Compiled kernels are cached apart for each state of their sources: a caller never runs an inlined old callee."""

import shutil
import subprocess
import sys
from pathlib import Path

import tracker

PROGRAM = """
import numpy as np
from tracker.contours import part_edges
from tracker.body.model import PosedBody
from tracker.geometry.cameras import Camera
from tracker.formats.model_toml import load_model
from tracker.geometry.rigid import transform
model = load_model("gavrila22")
R = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
camera = Camera("a", (640, 480), np.array([[520.0, 0, 320], [0, 520, 240], [0, 0, 1]]), np.zeros(0),
                transform(R, np.array([4.0, 0.0, 0.0])))
body = PosedBody(model, model.neutral())
behind = body.points_world - (0.5, 0.0, 0.0)
print(int(part_edges.points_hidden([body], [camera], behind).sum()))
"""


def run(folder):
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True, env={"PATH": "/usr/bin"})
    return int(done.stdout)


def test_an_edit_of_one_kernel_reaches_the_kernels_that_call_it(tmp_path):
    """`_mark_blocked` in part_edges.py compiles `hide` of visibility.py into itself."""
    copy = tmp_path / "tracker"
    shutil.copytree(Path(tracker.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__", "simulate"))
    before = run(tmp_path)
    assert before > 0
    visibility = copy / "contours" / "visibility.py"
    text = visibility.read_text()
    assert text.count("        far, near = shared[0, i], shared[1, i]\n") == 1
    (copy / "contours" / "visibility.py").write_text(
        text.replace("far, near = shared[0, i], shared[1, i]", "far, near = 1.0, 0.0")
    )
    assert run(tmp_path) == 0  # no line of sight is inside anything, so nothing hides
