"""Fixtures of runs over stored poses."""

import pytest

from tracker.estimation.trajectory import solve


@pytest.fixture
def blocks(monkeypatch):
    """Runs are tracked in blocks of two frames."""
    monkeypatch.setattr(solve, "_BLOCK_FRAMES", 2)
    monkeypatch.setattr(solve, "FRAMES_AT_ONCE", 2)
