"""Starts are fitted again while that pays, and a fit that costs more is not taken."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracker.formats.model_toml import load_model
from tracker.initialization import start_fit
from tracker.initialization.start_fit import fit_start

MODEL = load_model("gavrila34")


@pytest.fixture
def fits(monkeypatch):
    """Stands for the tracker: each fit to frame 5 costs the next of some numbers, and moves the pose by one."""
    costs, runs = [], []

    class Tracker:
        def __init__(self, settings):
            pass

        def estimates(self, run):
            runs.append(list(run.frames))
            for frame in run.frames:
                cost = costs[min(len(runs), len(costs)) - 1] if frame == 5 else 2.0
                yield SimpleNamespace(frame=frame, poses=(run.start[0] + 1,), statuses=("good",), cost_px=cost)

    monkeypatch.setattr(start_fit, "ChamferTracker", Tracker)
    monkeypatch.setattr(
        start_fit, "TrackingRun", lambda _, __, start, frames: SimpleNamespace(start=start, frames=frames)
    )
    return costs, runs


def fitted(later):
    return fit_start(None, [MODEL], np.zeros(3), 5, later, [])


def test_it_is_fitted_again_while_the_cost_falls(fits):
    costs, runs = fits
    costs[:] = [4.0, 3.0, 2.99, 1.0]
    found = fitted([[6, 7], [4]])
    assert runs == [[5], [5], [5], [5, 6, 7], [5, 4]]
    assert found.pose[0] == 3
    assert found.cost_px == pytest.approx((2.99 + 3 * 2.0) / 4)


def test_a_fit_that_costs_more_is_not_taken(fits):
    costs, _ = fits
    costs[:] = [3.0, 3.5]
    assert fitted([[6]]).pose[0] == 1


def test_a_start_without_a_track_is_fitted_once(fits):
    costs, runs = fits
    costs[:] = [4.0, 3.0]
    assert fitted(()).cost_px == 4.0
    assert runs == [[5]]
