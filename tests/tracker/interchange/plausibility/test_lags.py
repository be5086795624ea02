"""Lags between points and pictures: found from slow motion, with how far they are known."""

import cv2
import numpy as np
import pytest
from rigs import cameras, ring

from tracker.interchange.plausibility.filmed_people import FilmedPeople, MotionFinder
from tracker.interchange.plausibility.lags import Lag, combined_lag, find_lag

N, MOST = 60, 12
LIMBS = [f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "hip", "knee")]


def errors(lag, noise, seed=0):
    """Errors of 16 signals against those of other rows, (2 MOST + 1, N, 16)."""
    rng = np.random.default_rng(seed)
    signal = cv2.GaussianBlur(rng.normal(size=(N + 4 * MOST, 16)), (1, 0), 1, sigmaY=4)
    given = signal[2 * MOST :][:N] + noise * rng.normal(size=(N, 16))
    return np.stack([np.abs(given - signal[2 * MOST + s - lag :][:N]) for s in range(-MOST, MOST + 1)])


@pytest.mark.parametrize("lag", [-5, 0, 3])
def test_a_lag_is_found_with_its_limits(lag):
    found = find_lag(errors(lag, 0.05), MOST, 6)
    assert found.low <= lag <= found.high
    assert found.high - found.low <= 2
    assert found.frames == lag


def test_noise_has_no_lag():
    assert [find_lag(errors(4, 50.0, seed), MOST, 6) for seed in range(20)] == [None] * 20


def test_unknown_and_single_errors_have_no_lag():
    assert find_lag(np.full((5, 8, 3), np.nan), 2, 4) is None
    assert find_lag(np.abs(np.arange(-2.0, 3.0))[:, None, None] * np.ones((5, 8, 1)), 2, 8) is None


def test_a_lag_that_may_be_none_is_none():
    assert Lag(1.3, 0, 3).frames == 0
    assert str(Lag(2.9, 2, 4)) == "3 frames later (2 to 4)"
    assert str(Lag(-1.0, -1, -1)) == "1 frame earlier"


@pytest.mark.parametrize("lag", [0, 2, -2])
def test_lags_of_slow_motion_are_found_in_the_pictures(lag):
    """A textured board that sways by 4 cm, slower than 0.2 m/s: no silhouette shows two frames at 60 per second."""
    rng, step = np.random.default_rng(0), 2
    views = [c.scaled(0.25) for c in cameras(ring(2))]
    size = views[0].size
    texture = cv2.GaussianBlur(rng.integers(0, 255, (size[1], size[0], 3)).astype(np.uint8), (0, 0), 2)
    places = {name: rng.normal(size=3) * 0.1 + [0, 0, 1] for name in LIMBS}
    sway = 0.04 * np.array([np.convolve(x, np.hanning(31), "same")[15:-15] for x in rng.normal(size=(3, 130))]).T
    finder, middle = MotionFinder(step), np.array([[0.0, 0.0, 1.0]])
    for away in sway:
        moved = [(c.project(middle + away) - c.project(middle))[0] for c in views]
        finder.add([cv2.warpAffine(texture, np.array([[1, 0, u], [0, 1, v]]), size) for u, v in moved], views)
    rows = np.arange(10, 90, step)
    late = {name: place + sway[rows - lag] for name, place in places.items()}
    film = finder.motion(views)
    shown = type(film)(film.cameras, tuple(f[10:90] for f in film.flows), step)
    found = find_lag(shown.errors_m(late, 8), 8 * step, 15)
    assert found.low <= -lag <= found.high
    assert found.frames == -lag


@pytest.mark.parametrize("lag", [0, 3, -5])
def test_lags_are_found_by_silhouettes_alone(lag):
    """An arm that sways, of which no flow is known."""
    rng, views = np.random.default_rng(1), tuple(c.scaled(0.25) for c in cameras(ring(3)))
    sway = cv2.GaussianBlur(rng.normal(size=(100, 3)), (1, 0), 1, sigmaY=5) + np.array([0.0, 0.0, 1.0])
    arm = {"left_elbow": sway, "left_wrist": sway + np.array([0.0, 0.0, 0.2])}
    distances = []
    for view in views:
        ends = [np.round(view.project(place)).astype(int).tolist() for place in arm.values()]
        masks = [cv2.line(np.ones(view.size[::-1], np.uint8), a, b, 0, 5) for a, b in zip(*ends, strict=True)]
        shown = [cv2.distanceTransform(mask, cv2.DIST_L2, 3) for mask in masks[20:80]]
        distances.append(np.minimum(np.round(shown), 255).astype(np.uint8))
    people = FilmedPeople(views, tuple(distances), np.ones((60, 3), dtype=bool))
    late = {name: place[20 - lag : 80 - lag] + 0.01 * rng.normal(size=(60, 3)) for name, place in arm.items()}
    (errors_m,) = people.lag_errors_m(late, MOST)
    found = find_lag(errors_m, MOST, 6)
    assert found.low <= -lag <= found.high
    assert (found.frames != 0) == (lag != 0)


def test_evidence_of_two_kinds_limits_a_lag():
    wide, narrow = Lag(-5.5, -6, 4), Lag(-5.2, -7, -4)
    assert combined_lag([wide, narrow]) == combined_lag([narrow, None, wide]) == Lag(-5.2, -6, -4)
    assert combined_lag([narrow, Lag(0.0, -1, 1)]) is combined_lag([None]) is combined_lag([]) is None
