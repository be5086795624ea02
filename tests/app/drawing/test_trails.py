"""Trails from stored poses: which poses they join, what is computed again, what they cost on long footage."""

import numpy as np
import pytest

from app.drawing.predicted_pose import prediction
from app.drawing.trails import Trails
from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import PredictSettings

NAMES = frozenset(("left_wrist", "head"))


class Stored:
    """Poses of a body that walks along x, 1 cm a frame; remembers what was asked for."""

    def __init__(self, model, frames):
        self.model, self.frames, self.asked = model, set(frames), []

    def __call__(self, frames):
        self.asked.append(frames)
        return {k: self.at(k) for k in frames if k in self.frames}

    def at(self, frame):
        values = self.model.neutral()
        values[0] += 0.01 * frame
        return values


@pytest.fixture
def stored(gavrila):
    return Stored(gavrila, range(100))


def test_a_trail_goes_through_the_stored_poses(gavrila, stored):
    points, colors = Trails(gavrila, stored).segments(50, 10, NAMES, 100)
    assert points.shape == colors.shape == (40, 2, 3)
    wrist = gavrila.point_names.index("left_wrist")
    expected = [gavrila.points_world(stored.at(k))[wrist] for k in range(40, 61)]
    of_wrist = points[[i for i in range(40) if np.allclose(points[i, 0, 1:], expected[0][1:], atol=1e-6)]]
    assert of_wrist[:, 0] == pytest.approx(np.array(expected[:-1]), abs=1e-6)
    assert of_wrist[:, 1] == pytest.approx(np.array(expected[1:]), abs=1e-6)


def test_before_is_violet_after_is_green_and_the_ends_fade(gavrila, stored):
    points, colors = Trails(gavrila, stored).segments(50, 10, frozenset(("head",)), 100)
    of_time = colors[np.argsort(points[:, 0, 0]), 0].astype(int)
    before, after, first = of_time[9], of_time[11], of_time[0]
    assert before[2] > before[1] + 80
    assert after[1] > after[2] + 40
    assert np.ptp(first) < np.ptp(before) / 2


def test_gaps_are_not_bridged_and_names_of_others_are_passed_over(gavrila):
    stored = Stored(gavrila, [*range(10), *range(20, 30), 33])
    points, _ = Trails(gavrila, stored).segments(15, 25, frozenset(("head", "tail")), 100)
    lengths = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    assert len(points) == 9 + 9 + 1
    assert sorted(np.round(100 * lengths).astype(int)) == [1] * 18 + [4]


@pytest.mark.parametrize(("frame", "expected"), [(0, range(11)), (99, range(89, 100))])
def test_the_recordings_ends_end_the_trail(gavrila, stored, frame, expected):
    points, _ = Trails(gavrila, stored).segments(frame, 10, frozenset(("head",)), 100)
    assert len(points) == len(expected) - 1


def test_nothing_chosen_or_nothing_stored_draws_nothing(gavrila, stored):
    assert len(Trails(gavrila, stored).segments(50, 10, frozenset(), 100).points_world) == 0
    assert stored.asked == []
    assert len(Trails(gavrila, Stored(gavrila, [])).segments(50, 10, NAMES, 100).points_world) == 0


def test_only_what_is_new_is_read_and_what_changed_is_read_again(gavrila, stored):
    trails = Trails(gavrila, stored)
    trails.segments(50, 10, NAMES, 100)
    trails.segments(51, 10, NAMES, 100)
    assert stored.asked == [range(40, 61), range(61, 62)]
    stored.frames -= {55}
    trails.forget({55, 3})
    assert len(trails.segments(51, 10, frozenset(("head",)), 100).points_world) == 19
    assert stored.asked[2:] == [range(55, 56)]


@pytest.mark.parametrize("n_frames", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_long_footage_costs_what_short_costs(gavrila, monkeypatch, n_frames):
    """The next frame reads and computes one pose, whatever the recording's length."""
    stored, middle, computed = Stored(gavrila, range(n_frames)), n_frames // 2, []
    real = BodyModel.points_world
    monkeypatch.setattr(BodyModel, "points_world", lambda model, values: computed.append(1) or real(model, values))
    trails = Trails(gavrila, stored)
    trails.segments(middle, 250, NAMES, n_frames)
    assert sum(map(len, stored.asked)) == len(computed) == 501
    for frame in range(middle + 1, middle + 51):
        trails.segments(frame, 250, NAMES, n_frames)
    assert [len(asked) for asked in stored.asked[1:]] == [1] * 50
    assert len(computed) == 551
    for frame in range(0, n_frames, 700):
        trails.segments(frame, 250, NAMES, n_frames)
    assert len(trails._points) <= 4000 + 501


class TestPrediction:
    def test_it_goes_on_as_the_poses_before(self, gavrila, stored):
        predicted = prediction(gavrila, stored, 30, PredictSettings(order=1, window=3), backward=False)
        assert predicted.values == pytest.approx(stored.at(30))
        assert predicted.why == "from frames 27 to 29"

    def test_backward_it_goes_on_as_those_after(self, gavrila, stored):
        predicted = prediction(gavrila, stored, 30, PredictSettings(order=1, window=3), backward=True)
        assert predicted.values == pytest.approx(stored.at(30))
        assert predicted.why == "from frames 31 to 33"

    def test_only_poses_that_follow_one_another_count(self, gavrila):
        predicted = prediction(
            gavrila, Stored(gavrila, [3, 4, 6]), 7, PredictSettings(order=1, window=4), backward=False
        )
        assert predicted.values == pytest.approx(Stored(gavrila, []).at(6))
        assert predicted.why == "from frame 6"

    @pytest.mark.parametrize(
        ("frame", "backward", "why"), [(0, False, "before"), (99, True, "after"), (7, False, "before")]
    )
    def test_it_says_why_there_is_none(self, gavrila, frame, backward, why):
        stored = Stored(gavrila, [2, 3, 98, 99])
        predicted = prediction(gavrila, stored, frame, PredictSettings(), backward)
        assert predicted.values is None
        assert why in predicted.why
