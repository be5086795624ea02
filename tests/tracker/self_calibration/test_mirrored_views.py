"""Views that are mirrored, among joints of a person who walks."""

from dataclasses import replace

import numpy as np
import pytest
from filmed_people import SIZE, dancing, observed, rig

from tracker.calibration.reprojection import Observations
from tracker.errors import CalibrationError
from tracker.self_calibration.mirrored_views import require_unmirrored


def observations(cameras, points):
    """Places of joints, one group for each joint of each frame."""
    px = observed(cameras, points, gross=0.02).points.points_px[:, :, 0]
    px = np.moveaxis(px, 1, 0).reshape(len(cameras), -1, 2)
    views, groups = np.nonzero(np.isfinite(px).all(axis=2))
    return Observations(views, groups, px[views, groups])


@pytest.mark.parametrize("n", [2, 3, 5])
def test_true_views_pass(n):
    cameras = rig(n, arc=2.5)
    require_unmirrored(cameras, observations(cameras, dancing(12, seed=n)))


@pytest.mark.parametrize("n", [3, 5])
def test_a_mirrored_view_is_named(n):
    cameras = rig(n, arc=2.5)
    seen = observations(cameras, dancing(12, seed=n))
    px = seen.px.copy()
    px[seen.cameras == 1, 0] = SIZE[0] - 1 - px[seen.cameras == 1, 0]
    with pytest.raises(CalibrationError, match=r"those of camera .*'cam1'.* agree better with the others if"):
        require_unmirrored(cameras, replace(seen, px=px))
