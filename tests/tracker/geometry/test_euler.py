import numpy as np
import pytest

from tracker.geometry import rigid
from tracker.geometry.euler import continuous_euler_angles, euler_matrix


@pytest.mark.parametrize("order", ["ZXY", "XYZ"])
def test_angles_of_a_motion_give_its_rotations_and_do_not_jump(order):
    rng = np.random.default_rng(3)
    R = [np.eye(3)]
    for _ in range(400):
        R.append(R[-1] @ rigid.so3_exp(rng.normal(0, 0.1, 3)))
    R = np.array(R)
    angles = continuous_euler_angles(R, order)
    np.testing.assert_allclose(euler_matrix(angles, order), R, atol=1e-7)
    # Near a lock the angles move fast; elsewhere never by turns or halves.
    steps = np.abs(np.diff(angles, axis=0)).max(axis=1)[np.abs(np.cos(angles[1:, 1])) > 0.3]
    assert steps.max() < 1.0


@pytest.mark.parametrize("order", ["ZXY", "XYZ"])
@pytest.mark.parametrize("side", [1, -1])
def test_the_third_angle_stays_where_the_axes_coincide(order, side):
    angles = np.array(
        [[0.4, side * (np.pi / 2 - 0.2), 0.3], [0.4, side * np.pi / 2, 0.3], [0.6, side * np.pi / 2, 0.3]]
    )
    R = euler_matrix(angles, order)
    found = continuous_euler_angles(R, order)
    np.testing.assert_allclose(euler_matrix(found, order), R, atol=1e-7)
    np.testing.assert_allclose(found, angles, atol=1e-4)


def test_turns_are_counted_on():
    turns = np.linspace(0, 4 * np.pi, 50)
    angles = np.stack([turns, np.zeros(50), np.zeros(50)], axis=1)
    np.testing.assert_allclose(continuous_euler_angles(euler_matrix(angles, "ZXY"), "ZXY"), angles, atol=1e-7)
    assert continuous_euler_angles(np.empty((0, 3, 3)), "ZXY").shape == (0, 3)
