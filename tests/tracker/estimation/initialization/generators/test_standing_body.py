"""Sizes that are read from a body that stands."""

import numpy as np
import pytest

from tracker.estimation.initialization.generators.standing_body import ROUNDED, typical_person


def test_adult_has_the_sizes_of_the_body_file():
    adult = typical_person()
    assert adult.height_m == pytest.approx(1.75, abs=0.03)
    assert adult.segments_m("arm") == pytest.approx([0.284, 0.270, 0.150], abs=0.02)
    assert adult.segments_m("leg")[:2] == pytest.approx([0.424, 0.443], abs=0.01)
    assert adult.from_neck("left_hip") == pytest.approx([0.0, 0.0875, -0.522], abs=0.01)
    assert adult.share_of("leg") > 2 * adult.share_of("arm")


def test_child_has_a_large_head_and_short_legs():
    adult, child = typical_person(), typical_person(0.6)
    assert child.head_m / child.height_m > 1.1 * adult.head_m / adult.height_m
    assert child.segments_m("leg").sum() / child.height_m < 0.95 * adult.segments_m("leg").sum() / adult.height_m


def test_profile_narrows_at_the_neck():
    below_m, widths_m = typical_person(preset=ROUNDED).profile
    neck = np.argmin(np.where((below_m > 0.15) & (below_m < 0.35), widths_m, np.inf))
    assert widths_m[neck] < 0.75 * widths_m[:neck].max()
    assert widths_m[neck] < 0.5 * widths_m[neck + 1 :].max()
