"""Starts of a person are searched, tracked and compared; where a track comes back elsewhere, that is a start too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.estimation.fitting.hypothesis import BEAM_NATS, CLEAR_NATS, Hypothesis
from tracker.estimation.initialization.first_pose import ComparedStarts, compare_starts
from tracker.estimation.initialization.start_fit import StartTrack
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34")


def pose(x_m=0.0, **angles):
    """The neutral pose, moved along x, with some values added; `left_knee__extension=0.6`."""
    out = MODEL.neutral()
    out[0] += x_m
    for name, angle in angles.items():
        out[MODEL.value_names.index(name.replace("__", "."))] += angle
    return out


def start(x_m=0.0, name="voxels", cost=0.0, **angles):
    return Hypothesis(PosedBody(MODEL, pose(x_m, **angles)), name, cost)


class Fitter:
    """Stands for the fits: they stay, and cost on the frame and on tracks what functions of x say, nats."""

    def __init__(self, cost, on_frame=lambda x_m: 0.0, ends=None, lost=()):
        self.cost, self.on_frame, self.ends, self.lost, self.tracked = cost, on_frame, ends or {}, lost, []

    def fit(self, start):
        return start

    search = fit

    def scored(self, starts):
        return sorted((replace(s, cost=self.on_frame(s.pose[0])) for s in starts), key=lambda s: s.cost)

    def track(self, start):
        x_m = float(start.pose[0])
        self.tracked.append(x_m)
        end = SimpleNamespace(
            poses=(pose(self.ends.get(x_m, x_m)),), statuses=("lost" if x_m in self.lost else "good",)
        )
        return StartTrack(start, "good", 1.0, {5: start.pose}, False, (iter([end]),))

    def compared(self, tracks):
        scored = (t._replace(start=replace(t.start, cost=self.cost(t.start.pose[0]))) for t in tracks)
        return sorted(scored, key=lambda t: t.start.cost)


def compared(fitter, *proposals):
    return compare_starts(fitter, proposals, list)


def places(found):
    return [float(t.start.pose[0]) for t in found.tracked]


def test_the_most_likely_track_is_first():
    assert places(compared(Fitter(lambda x_m: -x_m), start(0.0), start(1.0))) == [1.0, 0.0]


def test_a_pose_that_a_track_comes_back_to_is_a_start():
    fitter = Fitter(lambda x_m: 1.0 if x_m == 0.3 else 2.0, ends={0.0: 0.3, 0.3: 0.6})
    comparison = compared(fitter, start(0.0, name="axis"))
    assert fitter.tracked == [0.0, 0.3]
    assert places(comparison) == [0.3, 0.0]
    assert comparison.tracked[0].start.source == "axis"


def test_a_track_that_comes_back_gives_no_other_start():
    assert places(compared(Fitter(lambda x_m: 1.0, ends={0.0: 0.01}), start(0.0))) == [0.0]


def test_a_person_who_is_lost_on_the_way_back():
    assert compared(Fitter(lambda x_m: 1.0, lost=(0.0,)), start(0.0)).is_lost
    # The start that the track came back to is another one.
    comparison = compared(Fitter(lambda x_m: 1.0 - x_m, ends={0.0: 0.3}, lost=(0.0,)), start(0.0))
    assert places(comparison)[0] == 0.3
    assert not comparison.is_lost


@pytest.mark.parametrize(("more", "n_tracked"), [(-1.0, 2), (1.0, 1)])
def test_a_start_that_is_much_less_likely_on_the_frame_is_not_tracked(more, n_tracked):
    fitter = Fitter(lambda x_m: 0.0, on_frame=lambda x_m: BEAM_NATS + more if x_m else 0.0)
    comparison = compared(fitter, start(0.0), start(1.0))
    assert len(comparison.tracked) == n_tracked
    assert len(comparison.searched) == 2


def test_starts_that_end_at_the_same_pose_are_one():
    fitter = Fitter(lambda x_m: x_m)
    comparison = compared(fitter, start(0.0, name="a"), start(0.02, name="b"), start(0.2, name="c"))
    assert [t.start.source for t in comparison.tracked] == ["a", "c"]


HERE = start()


def outcome(best, *others, searched=()):
    tracks = [StartTrack(h, "good", 1.0, {}) for h in (best, *others)]
    return ComparedStarts([best, *searched], tracks, False)


def test_left_and_right_are_sure_by_costs():
    turn = np.flatnonzero((MODEL.dof_joint == 0) & ~MODEL.dof_is_length)[-1]
    away = HERE.at(MODEL.retract(HERE.pose, 3.0 * np.eye(MODEL.n_dofs)[turn]))
    assert away.faces_away_from(HERE)
    assert not outcome(HERE).is_facing_sure
    assert outcome(HERE, replace(away, cost=CLEAR_NATS + 0.1)).is_facing_sure
    assert not outcome(HERE, replace(away, cost=CLEAR_NATS - 0.1)).is_facing_sure
    # A start that was not worth a track was much less likely on the frame.
    assert outcome(HERE, searched=[replace(away, cost=BEAM_NATS)]).is_facing_sure


def test_limbs_of_starts_that_are_about_as_likely_are_named():
    knee, elbow = start(cost=CLEAR_NATS - 0.1, left_knee__extension=0.6), start(right_elbow__extension=1.0)
    note = outcome(HERE, elbow, knee).rivals_note
    assert note.startswith("another start is about as good, with ")
    assert "left leg" in note
    assert "right arm" in note
    assert "right leg" not in note


def test_a_start_that_is_less_likely_is_no_rival():
    assert outcome(HERE, start(cost=CLEAR_NATS + 0.1, left_knee__extension=0.6)).rivals_note == ""
    assert outcome(HERE, start(cost=0.0)).rivals_note == ""
