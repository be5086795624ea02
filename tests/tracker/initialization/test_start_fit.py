"""Starts are fitted again while that pays, tracked there and back, and a fit that costs more is not taken."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.formats.model_toml import load_model
from tracker.initialization import start_fit
from tracker.initialization.start_fit import FittedStart, StartFitter, short_tracks, track_back

MODEL = load_model("gavrila34")
START = PosedBody(MODEL, MODEL.neutral())


def moved(pose, by_m):
    return pose + by_m * np.eye(len(MODEL.value_names))[0]


@pytest.fixture
def fits(monkeypatch):
    """Stands for the tracker: each fit to frame 5 costs the next of some numbers, and moves the body by a metre."""
    costs, runs, statuses = [], [], {}

    class Tracker:
        def __init__(self, settings):
            pass

        def estimates(self, run):
            runs.append(own := [])
            pose = run.start[0][-1]
            for frame in run.frames:
                own.append(frame)
                cost = costs[min(len(runs), len(costs)) - 1] if frame == 5 else 2.0
                pose = moved(pose, 1.0)
                yield SimpleNamespace(frame=frame, poses=(pose,), statuses=(statuses.get(frame, "good"),), cost_px=cost)

    monkeypatch.setattr(start_fit, "ChamferTracker", Tracker)
    monkeypatch.setattr(
        start_fit, "TrackingRun", lambda _, __, start, frames: SimpleNamespace(start=start, frames=frames)
    )
    monkeypatch.setattr(
        start_fit, "search_around", lambda _, bodies, *__: PosedBody(MODEL, moved(bodies[0].values, 10))
    )
    return costs, runs, statuses


def fitter(*later):
    return StartFitter(None, 5, later, ())


def test_a_start_is_searched_and_fitted_again(fits):
    costs, runs, _ = fits
    costs[:] = [4.0, 3.0, 1.0]
    found = fitter().search(START)
    assert runs == [[5], [5]]
    assert found.pose[0] == 12
    assert found.cost_px == 3.0


def test_a_stop_is_heard_after_each_frame_and_before_a_search(fits):
    costs, runs, _ = fits
    costs[:] = [4.0]
    heard = []

    def stop_at(n):
        def step():
            heard.append(len(heard))
            if len(heard) == n:
                raise InterruptedError

        return step

    with pytest.raises(InterruptedError):
        replace(fitter(), step=stop_at(1)).search(START)
    assert runs == []
    heard.clear()
    one_way = replace(fitter([7, 9, 11]), step=stop_at(3))
    with pytest.raises(InterruptedError):
        one_way.track(START, FittedStart(START.values, "good", 4.0))
    assert runs == [[5, 7, 9]]


def test_a_fit_that_costs_more_is_not_taken(fits):
    costs, _, _ = fits
    costs[:] = [3.0, 3.5]
    assert fitter().search(START).pose[0] == 11


def test_a_track_costs_the_mean_of_its_frames(fits):
    costs, runs, _ = fits
    costs[:] = [3.0]
    own = fitter([6, 7], [4])
    found = own.track(START, own.fit(START))
    assert found.cost_px == pytest.approx((3.0 + 3 * 2.0) / 4)
    assert found.pose[0] == 1  # that of the fit
    assert runs == [[5], [5, 6, 7], [5, 4]]
    assert not found.is_lost


def test_the_way_back_is_tracked_only_when_it_is_asked_for(fits):
    costs, runs, _ = fits
    costs[:] = [3.0]
    own = fitter([6, 7], [4])
    back = track_back(START, own.track(START, own.fit(START)))
    assert runs == [[5], [5, 6, 7, 6, 5], [5, 4, 5]]
    assert [p[0] for p in back.poses] == [5, 3]
    assert not back.is_lost


@pytest.mark.parametrize("lost", [6, 4])
def test_a_person_who_is_lost_on_a_track(fits, lost):
    costs, _, statuses = fits
    costs[:], statuses[lost] = [3.0], "lost"
    own = fitter([6, 7], [4])
    found = own.track(START, own.fit(START))
    assert found.is_lost
    assert found.status == "good"
    assert found.cost_px == pytest.approx((3.0 + 3 * 2.0 + 2.0) / 4)
    assert track_back(START, found).is_lost


def test_short_tracks_stay_within_the_recording():
    assert short_tracks(10, 100) == [[12, 14, 16], [8, 6, 4]]
    assert short_tracks(0, 4) == [[2]]
    assert short_tracks(3, 4) == [[1]]
