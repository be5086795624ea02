"""Compiled kernels are cached apart for each state of their sources: a caller never runs an inlined old callee."""

import shutil
import subprocess
import sys
from pathlib import Path

import tracker

PROGRAM = """
import numpy as np
from tracker import contours, posing, chamfer
from tracker.body import Body
from tracker.cameras import Camera
from tracker.formats.model_toml import load_model
from tracker.rigid import transform
model = load_model("gavrila22")
R = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
camera = Camera("a", (640, 480), np.array([[520.0, 0, 320], [0, 520, 240], [0, 0, 1]]), np.zeros(0),
                transform(R, np.array([4.0, 0.0, 0.0])))
contour = contours.trace([Body(model, model.neutral())], camera)
print(int(contour.hidden.sum()))
"""


def run(folder):
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True, env={"PATH": "/usr/bin"})
    return int(done.stdout)


def test_an_edit_of_one_kernel_reaches_the_kernels_that_call_it(tmp_path):
    """`trace_view` compiles `hide` into itself; both are moved to files of their own for the test."""
    copy = tmp_path / "tracker"
    shutil.copytree(Path(tracker.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__", "simulate"))
    source = (copy / "contours.py").read_text()
    first = source.index("@njit(nogil=True, cache=True)\ndef _inside_outside")
    last = source.index("@njit(nogil=True, cache=True)\ndef hide(")
    kernel = source[first:last]
    (copy / "inside.py").write_text(f"import numpy as np\nfrom numba import njit\n\nArray = np.ndarray\n\n\n{kernel}")
    moved = "from tracker.inside import _inside_outside\n"
    (copy / "contours.py").write_text(
        (source[:first] + source[last:]).replace("from tracker.rigid", moved + "from tracker.rigid", 1)
    )
    before = run(tmp_path)
    assert before > 0
    text = (copy / "inside.py").read_text()
    assert text.count("    zn = z / shape[2]\n") == 1
    (copy / "inside.py").write_text(text.replace("    zn = z / shape[2]\n", "    zn = z / shape[2] + 10.0\n"))
    assert run(tmp_path) == 0  # nothing is inside anything, so nothing hides
