"""The command line in this process, and a session to use it on."""

import shutil
import sys
from pathlib import Path

import pytest
from command_line import SAMPLE

from app import __main__


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process; gives exit status, standard output and standard error."""

    def run_it(*words):
        monkeypatch.setattr(sys, "argv", ["quadrille", *map(str, words)])
        capsys.readouterr()
        try:
            __main__.main()
            status = 0
        except SystemExit as end:
            status = end.code or 0
        return status, *capsys.readouterr()

    return run_it


@pytest.fixture
def session(tmp_path):
    """A working copy of the sample."""
    return Path(shutil.copytree(SAMPLE, tmp_path / "session"))
