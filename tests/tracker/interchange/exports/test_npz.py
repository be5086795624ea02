"""NPZ files, read by NumPy without pickle."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS
from stored_motions import store_motion

from tracker.formats.model_toml import parse_model
from tracker.geometry import rigid
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion
from tracker.interchange.exports.writers import write_npz
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange


@pytest.mark.parametrize("axes", ["calibration", "y-up"])
def test_arrays_have_poses_joints_covariances_and_cameras(tmp_path, axes):
    models = [MODELS["gavrila38"], MODELS["gavrila22"]]
    session, truth = store_motion(tmp_path / "s", models, gaps={(0, 3)}, lost={(1, 5)})
    errors = np.full((len(models[0].point_names), 3, 3), np.diag([0.01, 0.02, 0.03]) ** 2)
    with AnnotationStore(session.annotations_path) as store:
        changed = replace(store.pose("ann", 4), errors=errors)
        store.commit("Assess", [PoseChange("ann", 4, changed)], author="eve")
    motion = read_motion(session, (0, 1), [1, 3, 4, 5])
    write_npz(motion, ExportOptions(axes), [tmp_path / "a.npz"], lambda: None)
    found = np.load(tmp_path / "a.npz", allow_pickle=False)
    assert found["frames"].tolist() == [1, 3, 4, 5]
    assert found["people"].tolist() == ["ann", "bob"]
    T = file_from_world(session, axes)
    np.testing.assert_array_equal(found["T_file_world"], T)
    points, values = found["points"].tolist(), found["values"].tolist()
    bodies = dict(zip(found["bodies"].tolist(), found["body_models"].tolist(), strict=True))
    for i, frame in enumerate(found["frames"].tolist()):
        for j, name in enumerate(("ann", "bob")):
            if frame not in truth[j]:
                assert np.isnan(found["joints"][i, j]).all()
                assert found["status"][i, j] == ""
                continue
            body = truth[j][frame]
            columns = [points.index(p) for p in body.model.point_names]
            expected = rigid.apply(T, body.joint_centers_world)
            np.testing.assert_allclose(found["joints"][i, j, columns], expected, atol=1e-4)
            assert np.isnan(found["joints"][i, j]).all(axis=1).sum() == len(points) - len(columns)
            # The pose moves the body of its revision to the same place.
            model = parse_model(bodies[int(found["body_revision"][i, j])], name)
            pose = found["poses"][i, j, [values.index(v) for v in model.value_names]]
            np.testing.assert_allclose(rigid.apply(T, model.joint_centers_world(pose)), expected, atol=1e-9)
    assert found["status"].tolist() == [["good"] * 2, ["", "good"], ["good"] * 2, ["good", "lost"]]
    assert found["annotator"][2].tolist() == ["eve", ""]
    assert found["keyframe"][:, 0].tolist() == [True, False, False, False]
    axis = {"calibration": 2, "y-up": 1}[axes]
    wrist = points.index("left_wrist")
    assert found["covariance"][2, 0, wrist, axis, axis] == pytest.approx(0.03**2)
    assert np.isnan(found["covariance"][0]).all()
    for camera, K, lens, fisheye, T_world_camera in zip(
        session.cameras, *(found[f"camera_{k}"] for k in ("K", "distortion", "fisheye", "T_world_camera")), strict=True
    ):
        T_camera = np.linalg.inv(T_world_camera)
        pose = cv2.Rodrigues(T_camera[:3, :3])[0], T_camera[:3, 3], K, lens
        place = truth[0][1].joint_centers_world[:1]
        project = cv2.fisheye.projectPoints if fisheye else cv2.projectPoints
        np.testing.assert_allclose(project(place[:, None], *pose)[0].ravel(), camera.camera.project(place[0]), atol=0.1)
