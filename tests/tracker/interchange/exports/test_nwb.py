"""NWB files, read and checked by pynwb and ndx-pose."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS, with_center
from foreign import foreign, projected
from stored_motions import FPS, store_motion

from tracker.geometry import rigid
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion
from tracker.interchange.exports.nwb_writer import write_poses_nwb
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("axes", ["calibration", "y-up"])
def test_ndx_pose_finds_points_cameras_and_provenance(tmp_path, axes):
    pynwb, pose = foreign("pynwb"), foreign("ndx_pose")
    model = with_center(MODELS["gavrila38"], "left_hip", (0.01, 0.02, -0.03))
    session, truth = store_motion(tmp_path / "s", [model, MODELS["gavrila22"]], gaps={(0, 3)})
    session = replace(session, cameras=tuple(replace(c, offset=5) for c in session.cameras))
    errors = np.full((len(model.point_names), 3, 3), np.diag([0.01, 0.02, 0.03]) ** 2)
    with AnnotationStore(session.annotations_path) as store:
        changed = replace(store.pose("ann", 4), errors=errors)
        store.commit("Assess", [PoseChange("ann", 4, changed)], author="eve")
    path, T = tmp_path / "a.nwb", file_from_world(session, axes)
    write_poses_nwb(read_motion(session, (0, 1), range(2, 7)), ExportOptions(axes), [path], lambda: None)
    assert pynwb.validate(path=str(path)) == []
    with pynwb.NWBHDF5IO(str(path), "r") as reader:
        file = reader.read()
        behavior = file.processing["behavior"]
        for i, name in enumerate(("ann", "bob")):
            found = behavior[name]
            assert isinstance(found, pose.MultiCameraPoseEstimation)
            points = truth[i][2].model.point_names
            assert found.skeleton.nodes[:].tolist() == list(points)
            edges = {(points[a], points[b]) for a, b in found.skeleton.edges[:].tolist()}
            assert edges == set(truth[i][2].model.bones)
            for k, point in enumerate(points):
                series = found.pose_estimation_series[point]
                assert (series.unit, series.rate, series.starting_time) == ("meters", FPS, 2 / FPS)
                for row, frame in enumerate(range(2, 7)):
                    if frame not in truth[i]:
                        assert np.isnan(series.data[row]).all()
                        continue
                    place = truth[i][frame].joint_centers_world[k]
                    np.testing.assert_allclose(series.data[row], rigid.apply(T, place), atol=1e-4)
                    for source in session.cameras:
                        camera = source.camera
                        view = found.pose_estimations[f"{name}_{camera.name}"]
                        px = view.pose_estimation_series[point].data[row]
                        if np.isfinite(px).all():
                            np.testing.assert_allclose(px, projected(camera, place), atol=0.1)
                        assert view.device.name == camera.name
                        assert view.source_video.starting_time == pytest.approx(-5 / FPS)
                        assert view.source_video.external_file[0] == f"{camera.name}.mp4"
        # A camera projects the points in space of the file to the points in its pixels.
        view = behavior["ann"].pose_estimations["ann_cam0"]
        pose_of = cv2.Rodrigues(view.device.rotation_matrix[:].astype(float))[0], view.device.translation_vector[:]
        lens = view.device.intrinsic_matrix[:].astype(float), view.device.distortion_coefficients[:].astype(float)
        place = behavior["ann"].pose_estimation_series["left_wrist"].data[0].astype(float)
        px = cv2.projectPoints(place.reshape(1, 1, 3), pose_of[0], pose_of[1].astype(float), *lens)[0].ravel()
        np.testing.assert_allclose(view.pose_estimation_series["left_wrist"].data[0], px, atol=0.1)
        table = behavior["ann_provenance"].to_dataframe()
        assert table["frame"].tolist() == [2, 3, 4, 5, 6]
        assert table["annotator"].tolist() == ["", "", "eve", "", ""]
        assert table["status"].tolist() == ["good", "", "good", "good", "good"]
        axis = {"calibration": 2, "y-up": 1}[axes]
        wrist = model.point_names.index("left_wrist")
        assert table["covariance"][2][wrist, axis, axis] == pytest.approx(0.03**2)
