"""Starts of a person are searched, tracked and compared; where a track comes back elsewhere, that is a start too."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracker.formats.model_toml import load_model
from tracker.initialization import start_choice
from tracker.initialization.generators.start_generators import StartCandidate
from tracker.initialization.start_choice import compare_starts
from tracker.initialization.start_fit import FittedStart

MODEL = load_model("gavrila34")
AHEAD = np.array([1.0, 0.0, 0.0])


def at(x_m):
    """The neutral pose, moved along x."""
    return MODEL.neutral() + x_m * np.eye(len(MODEL.value_names))[0]


def candidate(x_m, forward=AHEAD, cues=0.0, name="voxels"):
    return StartCandidate(name, MODEL, at(x_m), forward, cues)


class Fitter:
    """Stands for the fits: they stay, a search costs 1 px at most, and tracks cost what a function of x says."""

    def __init__(self, cost, on_frame=lambda x_m: 1.0, ends=None, lost=()):
        self.cost, self.on_frame, self.ends, self.lost, self.tracked = cost, on_frame, ends or {}, lost, []

    def fit(self, start):
        return FittedStart(start.values, "good", self.on_frame(start.values[0]))

    search = fit

    def track(self, start, fitted):
        x_m = float(start.values[0])
        self.tracked.append(x_m)
        end = SimpleNamespace(poses=(at(self.ends.get(x_m, x_m)),), statuses=("lost" if x_m in self.lost else "good",))
        return FittedStart(start.values, "good", self.cost(x_m), False, (iter([end]),))


def compared(fitter, *candidates):
    return compare_starts(fitter, candidates, list)


def places(starts):
    return [float(fit.pose[0]) for _, fit in starts]


def test_the_cheapest_track_is_first():
    fitter = Fitter(lambda x_m: 3.0 - x_m)
    assert places(compared(fitter, candidate(0.0), candidate(1.0)).tracked) == [1.0, 0.0]


def test_a_pose_that_a_track_comes_back_to_is_a_start():
    fitter = Fitter(lambda x_m: 1.0 if x_m == 0.3 else 2.0, ends={0.0: 0.3, 0.3: 0.6})
    found = compared(fitter, candidate(0.0))
    assert fitter.tracked == [0.0, 0.3]
    assert places(found.tracked) == [0.3, 0.0]
    assert found.tracked[0][0].pose[0] == 0.0  # the candidate stays


def test_a_track_that_comes_back_gives_no_other_start():
    fitter = Fitter(lambda x_m: 1.0, ends={0.0: 0.01})
    assert places(compared(fitter, candidate(0.0)).tracked) == [0.0]


def test_a_person_who_is_lost_on_the_way_back():
    assert compared(Fitter(lambda x_m: 1.0, lost=(0.0,)), candidate(0.0)).is_lost
    # The start that the track came back to is another one.
    found = compared(Fitter(lambda x_m: 1.0 - x_m, ends={0.0: 0.3}, lost=(0.0,)), candidate(0.0))
    assert places(found.tracked)[0] == 0.3
    assert not found.is_lost


@pytest.mark.parametrize(("on_frame", "n_tracked"), [(1.2, 2), (1.3, 1)])
def test_a_start_that_costs_much_more_on_the_frame_is_not_tracked(on_frame, n_tracked):
    fitter = Fitter(lambda x_m: 1.0, on_frame=lambda x_m: on_frame if x_m else 1.0)
    found = compared(fitter, candidate(0.0), candidate(1.0, -AHEAD))
    assert len(found.tracked) == n_tracked
    assert places(found.searched) == [0.0, 1.0]


def test_starts_that_end_at_the_same_pose_are_one():
    fits = [(candidate(x, name=n), FittedStart(at(x), "good", 1.0)) for n, x in (("a", 0.0), ("b", 0.02), ("c", 0.2))]
    assert [c.generator for c, _ in start_choice._distinct(fits)] == ["a", "c"]
