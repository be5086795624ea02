"""Fixtures of runs over stored poses."""

import shutil

import pytest

from tracker.estimation.trajectory import solve
from tracker.session.session import load_session


@pytest.fixture
def blocks(monkeypatch):
    """Runs are tracked in blocks of two frames."""
    monkeypatch.setattr(solve, "_BLOCK_FRAMES", 2)
    monkeypatch.setattr(solve, "FRAMES_AT_ONCE", 2)


@pytest.fixture
def session(tmp_path, sample_folder):
    """A copy of the sample without poses."""
    session = load_session(shutil.copytree(sample_folder, tmp_path / "session"))
    session.annotations_path.unlink(missing_ok=True)
    return session
