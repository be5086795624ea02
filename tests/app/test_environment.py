"""The program wants the packages that it came with."""

import os
import subprocess
import sys


def test_another_tracker_on_the_path_is_named(tmp_path):
    other = tmp_path / "tracker"
    other.mkdir()
    (other / "__init__.py").write_text("")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    words = [sys.executable, "-c", "import app"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert done.returncode == 1
    line = done.stderr.strip().splitlines()[-1]
    assert "expected the package 'tracker' of Quadrille" in line
    assert str(other) in line
    assert "pipx" in line
