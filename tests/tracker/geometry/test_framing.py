from dataclasses import replace

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


def test_a_fisheye_shows_what_its_footage_shows():
    """At 64x48 px and 25 px a radian the side is at 73 degrees, and the upper border at 55."""
    K = np.array([[25.0, 0.0, 32.0], [0.0, 25.0, 24.0], [0.0, 0.0, 1.0]])
    camera = replace(CAMERA, K=K, distortion=np.zeros(4), fisheye=True)
    aside, above = np.array([np.sin(1.2), 0.0, np.cos(1.2) - 2.0]), np.array([0.0, np.sin(1.2), np.cos(1.2) - 2.0])
    found = [framings([camera], point[None])[0].text for point in (aside, above)]
    assert found == ["1.00 m, in the picture", "1.00 m, 6 px beside the picture"]
