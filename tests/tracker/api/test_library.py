"""The library as a stranger calls it: sessions and poses as arrays, work and results, wrong arguments."""

import shutil

import numpy as np
import pytest
from bodies import MODELS
from command_line import SAMPLE
from stored_motions import store_motion

import quadrille
from tracker.api.sessions import frames_of
from tracker.formats.pose_csv import read_pose_table
from tracker.pipeline.given_pose import set_pose_from_table


@pytest.fixture
def stored(tmp_path):
    """A session of two people with poses, without one of bob on frame 3, and their true bodies by frame."""
    return store_motion(tmp_path / "s", [MODELS["gavrila38"]] * 2, n_frames=6, gaps={(1, 3)}, lost={(1, 4)})


def test_poses_are_arrays_with_their_frames_times_and_covariances(stored):
    session, truth = stored
    poses = quadrille.read_poses(session.folder, "bob")
    assert poses.frames.tolist() == [0, 1, 2, 4, 5]
    assert np.allclose(poses.times_s, poses.frames / session.fps)
    assert poses.joints.shape == (5, len(poses.names), 3)
    assert poses.covariances.shape == (5, len(poses.names), 3, 3)
    assert poses.statuses[3] == "lost"
    body = truth[1][4]
    at = body.model.point_names.index("left_elbow")
    assert np.allclose(poses.joint("left_elbow")[3], body.joint_centers_world[at])
    with pytest.raises(KeyError, match="left_elbow"):
        poses.joint("elbow")


@pytest.mark.slow
def test_poses_are_tables_of_pandas_and_xarray(stored):
    session, truth = stored
    poses = quadrille.read_poses(session.folder, "bob")
    table, dataset = poses.to_pandas(), poses.to_xarray()
    row = table[(table.frame == 4) & (table.joint == "left_elbow")].iloc[0]
    place = truth[1][4].joint_centers_world[truth[1][4].model.point_names.index("left_elbow")]
    assert np.allclose(row[["x_m", "y_m", "z_m"]].astype(float), place)
    assert (row.status, row.time_s) == ("lost", 4 / session.fps)
    assert np.allclose(dataset.position.sel(joint="left_elbow", time=4 / session.fps), place)
    assert np.allclose(dataset.covariance, poses.covariances, equal_nan=True)


def test_a_range_of_frames_is_read_and_exported(stored, tmp_path):
    session, _ = stored
    assert quadrille.read_poses(session, "ann", range(2, 5)).frames.tolist() == [2, 3, 4]
    (path,) = quadrille.export(session, tmp_path / "ann.trc", people=["ann"], options={"units": "mm"})
    assert quadrille.evaluate(session, path, "ann").mpjpe_mm < 0.01
    with pytest.raises(quadrille.TrackerError, match="not to exist"):
        quadrille.export(session, path, people=["ann"])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: quadrille.read_poses(s), "name of a person"),
        (lambda s: quadrille.read_poses(s, "eve"), "ann, bob"),
        (lambda s: quadrille.read_poses(s, "ann", [9]), "frames from 0 to 5, found 9"),
        (lambda s: quadrille.export(s, "a.xyz"), "expected a format"),
        (lambda s: quadrille.export(s, "a.trc", options={"view": "C0"}), "expected no option 'view'"),
        (lambda s: quadrille.evaluate(s, "a.txt", "ann"), "expected a reference"),
        (lambda s: quadrille.open_session(s.folder / "none"), "none"),
    ],
)
def test_wrong_arguments_are_a_sentence(stored, call, words):
    with pytest.raises(quadrille.TrackerError, match=words):
        call(stored[0])


@pytest.mark.parametrize("frames", [[3], range(3, 4), [1, 3, 5], None])
def test_frames_at_one_distance_are_a_range(stored, frames):
    assert isinstance(frames_of(stored[0], frames), range)


def test_a_name_alone_is_no_list_of_names(stored):
    with pytest.raises(TypeError, match=r"\['ann'\]"):
        quadrille.export(stored[0], "a.trc", people="ann")


def test_footage_is_tracked_and_the_progress_stops_it(tmp_path):
    folder = shutil.copytree(SAMPLE, tmp_path / "s")
    session = quadrille.open_session(folder)
    set_pose_from_table(session, 0, 0, read_pose_table(SAMPLE / "truth.csv"))
    quadrille.track(folder, frames=range(3), options={"whole_run": False})
    assert quadrille.read_poses(folder).frames.tolist() == [0, 1, 2]

    def stop(stage, share):
        if share > 0.2:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        quadrille.track(folder, frames=range(40), options={"whole_run": False}, progress=stop)
    with pytest.raises(quadrille.TrackerError, match="expected options among"):
        quadrille.track(folder, options={"nothing": 1})
