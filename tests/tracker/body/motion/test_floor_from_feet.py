"""The floor under the feet: of people who stand about on a known plane, hop, and stand in a row."""

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.body.motion.floor_from_feet import FOOT_POINTS, floor_from_feet
from tracker.errors import TrackerError
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

TILT = rigid.so3_exp(np.array([0.06, -0.04, 0.0]))
HEIGHT_M, NOISE_M = 0.3, 0.004


@pytest.fixture(scope="module")
def body():
    return load_model("gavrila38", 1.6)


@pytest.fixture(scope="module")
def stands(body):
    """Return a person who stands on the plane, at a place of it and turned by an angle; raised by some metres."""
    names = body.point_names
    neutral = body.points_world(body.neutral())
    neutral = neutral - [0.0, 0.0, neutral[[names.index(n) for n in FOOT_POINTS], 2].min()]

    def at(x, y, turn=0.0, raised=0.0):
        points = (neutral @ rigid.so3_exp(np.array([0.0, 0.0, turn])).T + [x, y, HEIGHT_M + raised]) @ TILT.T
        return PosedBody(body, fit_to_points(body, dict(zip(names, points, strict=True))).pose)

    return at


def off_deg(found):
    return float(np.degrees(np.arccos(found.plane.normal @ TILT[:, 2])))


def test_it_lies_under_people_who_stand_about(stands):
    rng = np.random.default_rng(1)
    people = [
        {k: stands(*rng.uniform(-1, 1, 2), rng.uniform(-3, 3), NOISE_M * rng.standard_normal()) for k in range(n)}
        for n in (9, 4)
    ]
    floor = floor_from_feet(people)
    assert off_deg(floor) < 3 * floor.tilt_deg < 3.0
    assert floor.plane.offset_m == pytest.approx(HEIGHT_M, abs=2 * NOISE_M)
    assert floor.spread_m < 2 * NOISE_M
    assert floor.n_places >= 9


@pytest.mark.slow
def test_frames_in_the_air_do_not_count(stands):
    about = [(x, y, 0.7 * x) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    person = {k: stands(*place, raised=0.25 * (k % 3 == 1)) for k, place in enumerate(about)}
    floor = floor_from_feet([person])
    assert off_deg(floor) < 0.1
    assert floor.plane.offset_m == pytest.approx(HEIGHT_M, abs=0.002)


@pytest.mark.slow
def test_a_row_of_steps_shows_no_plane(stands):
    row = {k: stands(0.2 * k, 0.0, turn, 1e-4 * k) for k, turn in enumerate((0.01, -0.02, 0.01, 0.0, -0.01, 0.02))}
    with pytest.raises(TrackerError, match=r"expected feet that stood far from one line, found them within \d+ cm of"):
        floor_from_feet([row])


def test_without_poses_or_feet_it_says_so(stands, gavrila):
    with pytest.raises(TrackerError, match="expected poses whose feet show the floor, found none; track first"):
        floor_from_feet([{}])
    with pytest.raises(TrackerError, match="expected bodies with feet, found gavrila22 without 'left_heel'"):
        floor_from_feet([{0: PosedBody(gavrila, gavrila.neutral())}])
