"""BlazePose: squares of pictures, and its networks on rendered footage where a user has fetched them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.formats.trc import read_trc
from tracker.interchange.detection.blazepose import _anchors, _groups, _refined
from tracker.interchange.detection.detector import PictureSquare
from tracker.session.assemble import NewSession, assemble


@given(st.floats(-4, 4), st.floats(20, 900), st.integers(32, 300))
def test_a_square_is_mapped_upright_into_its_image(turn, side, size):
    square = PictureSquare(np.array([310.0, 170.0]), side, turn)
    A = square.to_pixels(size)
    middle = A[:, :2] @ square.center_px + A[:, 2]
    np.testing.assert_allclose(middle, (size - 1) / 2, atol=1e-6)
    above = square.center_px + side / 2 * np.array([np.sin(turn), -np.cos(turn)])
    np.testing.assert_allclose(A[:, :2] @ above + A[:, 2] - middle, [0, -size / 2], atol=1e-6)


def test_the_finder_has_as_many_anchors_as_outputs():
    anchors = _anchors(224)
    assert anchors.shape == (2254, 2)
    np.testing.assert_allclose(anchors[[0, 1, 2, -1]], [[1 / 56] * 2, [1 / 56] * 2, [3 / 56, 1 / 56], [13 / 14] * 2])


def test_boxes_that_overlap_are_of_one_person():
    boxes = np.array([[0, 0, 10, 10], [1, 0, 10, 10], [30, 0, 10, 10], [0, 0, 0, 0]], float)
    groups = _groups(boxes, np.array([0.7, 0.9, 0.8, 0.6]))
    assert [g.tolist() for g in groups] == [[1, 0], [2], [3]]


def test_landmarks_move_to_their_heat_maps_unless_these_are_cold():
    heat = np.full((64, 64, 2), -20.0)
    heat[21, 31, 0], heat[21, 31, 1] = 9.0, -1.0
    found = _refined(np.array([[30.0, 20.0], [30.0, 20.0]]) / 64, heat) * 64
    np.testing.assert_allclose(found, [[31, 21], [30, 20]], atol=1e-3)


@pytest.mark.slow
def test_a_man_who_walks_is_detected_in_all_views(tmp_path, data_folder, detected):
    """The points of the heavy network, without any fit, are within 60 mm of the joints: hips and shoulders are off."""
    walk = data_folder("walk")
    videos = tuple(sorted(walk.glob("*.mp4")))
    session = assemble(NewSession(tmp_path / "s", walk / "Calib.toml", videos=videos))
    observations, found = detected(session, range(8))
    truth = read_trc(walk / "ground_truth.trc")
    for side in ("left", "right"):
        for joint, marker in (("wrist", "Hand"), ("ankle", "Foot"), ("knee", "Leg"), ("elbow", "ForeArm")):
            own = found.joints_world[:8, 0, found.names.index(observations.joint_map.markers[f"{side}_{joint}"])]
            true = truth.points[:8, truth.names.index(side.capitalize() + marker)]
            assert np.linalg.norm(own - true, axis=1).mean() < 0.06, f"{side} {joint}"
