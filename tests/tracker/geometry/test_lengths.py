"""Units of lengths."""

import pytest

from tracker.geometry.lengths import height_m


@pytest.mark.parametrize(("number", "metres"), [(1.78, 1.78), (178, 1.78), (62, 0.62), (0.62, 0.62), (9, 9), (-1, -1)])
def test_a_height_is_in_the_unit_in_which_it_is_usual(number, metres):
    assert height_m(number) == pytest.approx(metres)
