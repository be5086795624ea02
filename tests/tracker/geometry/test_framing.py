import numpy as np
import pytest

from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.geometry.framing import framings

K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
CAMERA = Camera("front", (64, 48), K, np.array([-0.3, 0.1, 0.0, 0.0]), rigid.transform(t=np.array([0.0, 0.0, -2.0])))


@pytest.mark.parametrize(
    ("points", "text"),
    [
        ([[0.0, 0.0, 0.0], [0.2, 0.3, 0.0]], "2.01 m, in the picture"),
        ([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0]], "20.10 m, 1 of 2 joints"),
        ([[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]], "3.20 m, 18 px beside the picture"),  # at 82 of 63.5 px
        ([[0.0, 0.0, -3.0], [0.0, 0.0, -5.0]], "2.00 m, behind the camera"),
        ([[4.0, 0.0, -1.99], [9.0, 0.0, -1.999]], "6.50 m, behind the camera"),  # at the plane of the camera
    ],
)
def test_the_place_of_points_in_a_view(points, text):
    (found,) = framings([CAMERA], np.array(points))
    assert found.text == text
