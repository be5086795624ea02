"""OpenPose's JSON of each view and frame, in original and in undistorted pixels."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS, with_center
from foreign import projected
from stored_motions import K1, filmed, store_motion

from tracker.errors import RecordingError
from tracker.formats.anipose import read_calibration
from tracker.formats.keypoints.detections import read_openpose
from tracker.interchange.exports.label_writers import write_points
from tracker.interchange.exports.motion import ExportOptions, read_motion

LIMBS = {
    "RElbow": "right_elbow",
    "LWrist": "left_wrist",
    "LHip": "left_hip",
    "RAnkle": "right_ankle",
    "LBigToe": "left_toe",
}
NAMES = [
    "Nose", "Neck", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist", "MidHip", "RHip", "RKnee",
    "RAnkle", "LHip", "LKnee", "LAnkle", "REye", "LEye", "REar", "LEar", "LBigToe", "LSmallToe", "LHeel", "RBigToe",
    "RSmallToe", "RHeel",
]  # fmt: skip


def written(folder, camera, number):
    text = (folder / f"{camera}_json" / f"{camera}_{number:012d}_keypoints.json").read_text()
    return [(p, np.array(p["pose_keypoints_2d"]).reshape(25, 3)) for p in json.loads(text)["people"]]


def test_points_are_where_the_footage_shows_them(tmp_path):
    model = with_center(MODELS["gavrila38"], "left_hip", (0.01, 0.02, -0.03))
    session, truth = store_motion(tmp_path / "s", [model, MODELS["gavrila22"]], gaps={(0, 3)})
    session = replace(session, cameras=tuple(replace(c, offset=5) for c in session.cameras))
    write_points(read_motion(session, (0, 1), range(2, 5)), ExportOptions(), [tmp_path / "o"], lambda: None)
    n_checked = 0
    for source in session.cameras:
        camera = source.camera
        assert camera.fisheye or camera.distortion[0] == K1
        for frame in range(2, 5):
            people = {p["person_id"][0]: (p, points) for p, points in written(tmp_path / "o", camera.name, frame + 5)}
            own = read_openpose(
                tmp_path / "o" / f"{camera.name}_json" / f"{camera.name}_{frame + 5:012d}_keypoints.json"
            )
            for one, (_, points) in zip(own, people.values(), strict=True):
                np.testing.assert_array_equal(np.nan_to_num(one.points), points)
            assert set(people) == {i for i in (0, 1) if frame in truth[i]}
            for i, (person, points) in people.items():
                places = dict(zip(truth[i][frame].model.point_names, truth[i][frame].joint_centers_world, strict=True))
                places["mid"] = (places["left_hip"] + places["right_hip"]) / 2
                for name, own in (LIMBS | {"MidHip": "mid", "Neck": "neck"}).items():
                    row = points[NAMES.index(name)]
                    if own not in places:
                        assert not row.any()
                    elif row[2]:
                        np.testing.assert_allclose(row[:2], projected(camera, places[own]), atol=0.1)
                        n_checked += 1
                assert not points[NAMES.index("Nose")].any()
                assert [v > 0 for v in person["pose_visibility"]] == (points[:, 2] > 0).tolist()
    assert n_checked > 50


def test_undistorted_points_come_with_such_pictures_and_cameras(tmp_path):
    session, truth = store_motion(tmp_path / "s", [MODELS["gavrila38"]], n_frames=3)
    session = filmed(session, tmp_path)
    folder = tmp_path / "o"
    write_points(read_motion(session, (0,), [1]), ExportOptions(pixels="undistorted"), [folder], lambda: None)
    cameras = read_calibration(folder / "calibration.toml")
    assert [c.is_pinhole for c in cameras] == [True] * 3
    for camera, source in zip(cameras, session.cameras, strict=True):
        ((_, points),) = written(folder, camera.name, 6)
        place = truth[0][1].named_points_world["left_wrist"]
        np.testing.assert_allclose(points[NAMES.index("LWrist"), :2], projected(camera, place), atol=0.1)
        picture = cv2.imread(str(folder / "images" / camera.name / "000006.jpg"), cv2.IMREAD_GRAYSCALE)
        assert picture.shape == camera.size[::-1]
        # The dot of the footage is where the lens, taken away, moves it.
        dot = np.argwhere(picture > 200).mean(axis=0)[::-1]
        expected = source.camera.undistort_points(np.array([150.0, 120.0]))
        np.testing.assert_allclose(dot, expected, atol=1.0)


def test_missing_footage_is_named(tmp_path):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila22"]], n_frames=2)
    with pytest.raises(RecordingError, match="cam0"):
        write_points(read_motion(session, (0,)), ExportOptions(pixels="undistorted"), [tmp_path / "o"], lambda: None)
