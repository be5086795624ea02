"""Views that are mirrored, among joints of a person who walks."""

from dataclasses import replace

import numpy as np
import pytest
from detected_people import acted, detected
from filmed_people import SIZE, dancing, observed, rig

from tracker.calibration.check.rig_adjustment import Observations
from tracker.calibration.self_calibration.keypoint_calibration import require_unmirrored
from tracker.errors import CalibrationError

SIGMA_PX = 3.0


def observations(cameras, points):
    """Places of joints of a person who dances."""
    return places(observed(cameras, points, SIGMA_PX, gross=0.02).points.points_px[:, :, 0])


def places(px):
    """Places of joints, one group for each joint of each frame."""
    px = np.moveaxis(px, 1, 0).reshape(px.shape[1], -1, 2)
    views, groups = np.nonzero(np.isfinite(px).all(axis=2))
    return Observations(views, groups, px[views, groups])


@pytest.mark.parametrize("n", [2, 3, 5])
def test_true_views_pass(n):
    cameras = rig(n, arc=2.5)
    require_unmirrored(cameras, observations(cameras, dancing(12, seed=n)), SIGMA_PX)


@pytest.mark.parametrize("n", [3, 5])
def test_a_mirrored_view_is_named(n):
    cameras = rig(n, arc=2.5)
    seen = observations(cameras, dancing(12, seed=n))
    px = seen.px.copy()
    px[seen.cameras == 1, 0] = SIZE[0] - 1 - px[seen.cameras == 1, 0]
    with pytest.raises(CalibrationError, match=r"those of camera .*'cam1'.* agree better with the others if"):
        require_unmirrored(cameras, replace(seen, px=px), SIGMA_PX)


@pytest.mark.slow
def test_a_dance_on_the_spot_with_gross_errors_passes_and_is_named_where_it_is_mirrored():
    """Joints by views with gross errors lie metres away, and draw a pose that heeds all of them."""
    cameras, (joints, _) = rig(), acted("dance", 60)
    px = detected(cameras, joints[:, :1]).points.points_px[:, :, 0]
    require_unmirrored(cameras, places(px), SIGMA_PX)
    px[:, 1, :, 0] = SIZE[0] - 1 - px[:, 1, :, 0]
    with pytest.raises(CalibrationError, match=r"those of camera .*'cam1'.* agree better with the others if"):
        require_unmirrored(cameras, places(px), SIGMA_PX)
