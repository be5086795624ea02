"""Starts are searched, tracked there and back, and scored in nats on common evidence."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization import start_fit
from tracker.estimation.initialization.start_fit import StartFitter, StartTrack, short_tracks, track_back
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34")
START = Hypothesis(PosedBody(MODEL, MODEL.neutral()), "test")


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


def test_a_start_is_searched_and_fitted(fits):
    costs, runs, _ = fits
    costs[:] = [4.0]
    found = fitter().search(START)
    assert runs == [[5]]
    assert found.pose[0] == 11
    assert (found.source, found.cost) == ("test", np.inf)


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
        one_way.track(START)
    assert runs == [[5, 7, 9]]


def test_a_track_has_the_poses_of_its_frames_and_their_mean_cost(fits):
    costs, runs, _ = fits
    costs[:] = [3.0]
    found = fitter([6, 7], [4]).track(START)
    assert found.cost_px == pytest.approx((3.0 + 3 * 2.0) / 4)
    assert {k: v[0] for k, v in found.poses.items()} == {5: 1, 6: 2, 7: 3, 4: 2}
    assert found.start.pose[0] == 1
    assert runs == [[5, 6, 7], [5, 4]]
    assert not found.is_lost


def test_the_only_frame_of_a_recording_is_a_track(fits):
    costs, runs, _ = fits
    costs[:] = [3.0]
    assert fitter().track(START).poses.keys() == {5}
    assert runs == [[5]]


def test_the_way_back_is_tracked_only_when_it_is_asked_for(fits):
    costs, runs, _ = fits
    costs[:] = [3.0]
    found, is_lost = track_back(fitter([6, 7], [4]).track(START))
    assert runs == [[5, 6, 7, 6, 5], [5, 4, 5]]
    assert [h.pose[0] for h in found] == [5, 3]
    assert not is_lost


@pytest.mark.parametrize("lost", [6, 4])
def test_a_person_who_is_lost_on_a_track(fits, lost):
    costs, _, statuses = fits
    costs[:], statuses[lost] = [3.0], "lost"
    found = fitter([6, 7], [4]).track(START)
    assert found.is_lost
    assert found.status == "good"
    assert track_back(found)[1]


def test_costs_are_summed_over_the_frames(monkeypatch):
    """All starts of a frame are scored on the same evidence, around all of them."""
    away, seen = Hypothesis(PosedBody(MODEL, moved(MODEL.neutral(), 1.0))), []
    monkeypatch.setattr(start_fit, "common_evidence", lambda _, frame, guesses, __: seen.append(len(guesses)) or frame)
    monkeypatch.setattr(
        start_fit, "scorer_without_prediction",
        lambda frame, *_: SimpleNamespace(costs_with_priors=lambda model, poses: 10.0 * frame + poses[:, 0]),
    )  # fmt: skip
    own = fitter()
    assert [h.cost for h in own.scored([away, START])] == [50.0, 51.0]
    tracks = [StartTrack(h, "good", 1.0, {5: h.pose, 7: moved(h.pose, 3.0)}) for h in (away, START)]
    assert [t.start.cost for t in own.compared(tracks)] == [50 + 73, 51 + 74]
    assert seen == [2, 2, 2]


def test_short_tracks_stay_within_the_recording():
    assert short_tracks(10, 100) == [[12, 14, 16], [8, 6, 4]]
    assert short_tracks(0, 4) == [[2]]
    assert short_tracks(3, 4) == [[1]]
