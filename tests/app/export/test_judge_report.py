"""Pictures of the report on a judgement."""

import numpy as np
import pytest

from app.export.judge_report import _HEIGHT_PX, _cropped


@pytest.mark.parametrize("at", [(680.0, 240.0), (320.0, 520.0), (-40.0, -40.0), (320.0, 240.0)])
def test_a_person_beside_the_picture_is_shown_by_its_border(at):
    picture = _cropped(np.zeros((480, 640, 3), np.uint8), np.add(at, [(0.0, 0.0), (6.0, 4.0)]))
    assert picture.shape[0] == _HEIGHT_PX
    assert picture.shape[1] > 0
