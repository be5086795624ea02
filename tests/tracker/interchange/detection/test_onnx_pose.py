"""ONNX files are known by their outputs, and what they say is placed in the picture."""

import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.interchange.detection.detector import PictureSquare
from tracker.interchange.detection.detectors import load_detector

pytestmark = pytest.mark.slow
pytest.importorskip("onnx", reason="onnx and onnxruntime are of the slow tests")
from tiny_networks import write_finder, write_landmarks, write_people  # noqa: E402  needs onnx

BOX = [16.0, 8.0, 32.0, 56.0, 0.9]
WHOLE = PictureSquare(np.array([319.5, 239.5]), 640.0)


def picture(x, y):
    out = np.zeros((480, 640, 3), np.uint8)
    out[y - 2 : y + 3, x - 2 : x + 3] = 255
    return out


def load(folder, *files):
    return load_detector("onnx", ",".join(f.name for f in files), folder)


@pytest.mark.parametrize(("n_points", "skeleton"), [(17, "COCO_17"), (26, "HALPE_26"), (133, "WHOLEBODY_133")])
def test_points_of_rtmpose_lie_where_the_network_sees_them(tmp_path, n_points, skeleton):
    files = write_landmarks(tmp_path / "pose.onnx", n_points), write_finder(tmp_path / "yolox.onnx", [BOX], [0])
    detector, text = load(tmp_path, *files)
    assert (detector.skeleton, text) == (skeleton, "onnx pose.onnx,yolox.onnx")
    for turn in (0.0, 1.2, np.pi):
        person = detector.look(picture(300, 200), PictureSquare(np.array([310.0, 190.0]), 256.0, turn))
        assert person.points_px.shape == (n_points, 2)
        assert np.abs(person.points_px - [300, 200]).max() <= 3
    assert detector.look(picture(300, 200), PictureSquare(np.array([80.0, 80.0]), 100.0)) is None


def test_a_finder_names_people_alone_as_squares_of_the_picture(tmp_path):
    boxes = [[0.0, 0.0, 9.0, 9.0, 0.95], BOX, [1.0, 1.0, 5.0, 5.0, 0.2]]
    files = write_landmarks(tmp_path / "pose.onnx"), write_finder(tmp_path / "yolox.onnx", boxes, [7, 0, 0])
    (square,) = load(tmp_path, *files)[0].find(picture(9, 9), WHOLE)
    np.testing.assert_allclose(square.center_px, [319.5 + 10 * (24 - 31.5), 239.5 + 10 * (32 - 31.5)])
    assert square.side_px == pytest.approx(1.25 * 10 * 48)


def test_rtmo_finds_people_with_their_points(tmp_path):
    points = np.full((2, 17, 3), 31.5)
    points[0, :, 0], points[..., 2] = 10.0, 0.8
    boxes = [BOX, [2.0, 2.0, 60.0, 60.0, 0.7]]
    detector, _ = load(tmp_path, write_people(tmp_path / "rtmo.onnx", boxes, points))
    assert len(detector.find(picture(9, 9), WHOLE)) == 2
    person = detector.look(picture(9, 9), WHOLE)
    np.testing.assert_allclose(person.points_px, np.tile([319.5, 239.5], (17, 1)), atol=1e-3)
    assert (person.presence, person.confidence[0]) == (pytest.approx(0.7), pytest.approx(0.8))


def test_files_that_make_no_detector_are_named(tmp_path):
    pose = write_landmarks(tmp_path / "pose.onnx")
    with pytest.raises(TrackerError, match=r"RTMPose with a finder .* found pose.onnx \(landmarks\); give both"):
        load(tmp_path, pose)
    with pytest.raises(TrackerError, match=r"number of points of a known skeleton.* found 5"):
        load(tmp_path, write_landmarks(tmp_path / "five.onnx", 5), write_finder(tmp_path / "f.onnx", [BOX], [0]))
    (tmp_path / "text.onnx").write_text("no network")
    with pytest.raises(TrackerError, match=r"expected a network at .*text.onnx"):
        load(tmp_path, tmp_path / "text.onnx")
    with pytest.raises(TrackerError, match="expected as the model of onnx a file, found 'None'"):
        load_detector("onnx", None, tmp_path)
