"""Temporary folders of killed programs are removed by the next program, those of others are not."""

import subprocess
import sys

from app.runtime.temporary_folder import TemporaryFolder

KILLED = """
import os, signal, sys
from app.runtime.temporary_folder import TemporaryFolder
(TemporaryFolder(sys.argv[1]).path / "socket").touch()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_files_of_a_killed_program_are_removed(tmp_path):
    foreign = tmp_path / "quadrille-of-somebody"
    foreign.mkdir()
    running = TemporaryFolder(str(tmp_path))
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], timeout=60)
    assert len(list(tmp_path.iterdir())) == 3
    folder = TemporaryFolder(str(tmp_path))
    assert folder.path.stat().st_mode & 0o077 == 0
    assert sorted(tmp_path.iterdir()) == sorted([foreign, running.path, folder.path])
    folder.close()
    running.close()
    assert list(tmp_path.iterdir()) == [foreign]
