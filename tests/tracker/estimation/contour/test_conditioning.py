"""Rank and conditioning of a normal matrix (KRH08 Sect. 5.4)."""

import numpy as np

from tracker.estimation.contour.tracker import conditioning
from tracker.estimation.fitting.gauss_newton import NormalEquations


def of(diagonal, active=None):
    return tuple(conditioning(NormalEquations(0.0, np.zeros(3), np.diag(diagonal)), active))


def test_rank_and_condition_count_what_may_move():
    assert of([4.0, 1.0, 2.0]) == (3, 3, 4.0)
    assert of([4.0, 0.0, 2.0]) == (2, 3, np.inf)
    assert of([4.0, 0.0, 2.0], np.array([True, False, True])) == (2, 2, 2.0)
    assert of([4.0, 0.0, 2.0], np.zeros(3, bool)) == (0, 0, np.inf)
    assert of([0.0, 0.0, 0.0])[0] == 0


def test_zero_in_single_precision_has_no_rank():
    assert of([1.0, 1e-9, 1.0])[0] == 2
    assert of([1.0, 1e-5, 1.0])[0] == 3
