import numpy as np
import pytest
from staging import posed

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import velocity


@pytest.mark.parametrize("around", [(-2, -1, 0, 1, 2), (-1, 0, 1), (-1, 0), (0, 1), (-2, 0, 1)])
def test_velocity_of_an_even_motion(gavrila, around):
    start, rate = posed(gavrila, 1), np.linspace(-0.02, 0.03, gavrila.n_dofs)
    poses = {7 + i: gavrila.retract(start, i * rate) for i in around}
    np.testing.assert_allclose(velocity(gavrila, poses, 7), rate, atol=1e-9)


def test_without_a_neighbour_it_is_unknown(gavrila):
    pose = posed(gavrila, 1)
    assert velocity(gavrila, {3: pose, 5: pose}, 3) is None
    assert velocity(gavrila, {2: pose, 4: pose}, 3) is None


def test_full_turn_is_no_leap(gavrila):
    before, after = (np.array(gavrila.neutral()) for _ in range(2))
    free = [i for i in np.flatnonzero(gavrila.dof_joint == 0) if not gavrila.dof_is_length[i]]
    winding = next(i for i in free if np.isinf(gavrila.limits[i]).all())
    before[winding], after[winding] = np.pi - 0.01, -np.pi + 0.01
    assert np.abs(velocity(gavrila, {0: before, 1: after}, 0)).max() == pytest.approx(0.02)


def test_body_ahead_moves_by_its_velocity(gavrila):
    body = PosedBody(gavrila, posed(gavrila, 2), np.full(gavrila.n_dofs, 0.01))
    np.testing.assert_allclose(gavrila.difference(body.ahead(-0.5).values, body.values), -0.005, atol=1e-9)
    assert body.ahead(0.0) is body
    assert PosedBody(gavrila, body.values).ahead(0.5).values is body.values
