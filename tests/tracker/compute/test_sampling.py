"""Items chosen far from one another."""

import numpy as np

from tracker.compute.sampling import farthest_first


def test_points_are_chosen_far_from_one_another():
    points = np.array([[0.0], [0.1], [9.0], [5.0], [5.1], [9.1]])
    assert list(farthest_first(points, 3)) == [3, 0, 5]
    assert list(farthest_first(np.zeros((4, 2)), 3, 1e-9)) == [0]
    assert list(farthest_first(np.zeros((0, 2)), 3)) == []


def test_poses_are_as_far_apart_as_the_joint_that_moves_most():
    joints = np.zeros((12, 5, 3))
    joints[3], joints[7], joints[9] = 1.0, -1.0, [0, 2.0, 0]
    assert {3, 7, 9} < set(farthest_first(joints, 4))
    assert sorted(farthest_first(joints, 50)) == [*range(12)]
    assert len(farthest_first(joints, 50, 0.1)) == 4
    assert len(farthest_first(joints, 50, 0.1, fewest=6)) == 6
