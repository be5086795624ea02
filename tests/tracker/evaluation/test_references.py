import shutil
from dataclasses import replace

import numpy as np
import pytest
from stored_motions import store_poses

from tracker.errors import FormatError, SessionError
from tracker.evaluation.references import read_joints, read_reference, stored_motion
from tracker.footage.camera_source import CameraSource
from tracker.formats.joint_maps import JOINTS
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import write_pose_table
from tracker.formats.trc import read_trc, write_trc
from tracker.session.session import Person, create_session, load_session


@pytest.fixture
def copy(sample_folder, tmp_path):
    """A working copy of the sample's session, without its footage."""
    for name in ("session.toml", "calibration.toml", "models"):
        source = sample_folder / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, tmp_path / name)
    return load_session(tmp_path)


def two_people(tmp_path, copy, names=("ann", "bob"), model="gavrila22"):
    cameras = [CameraSource(c.camera, c.footage) for c in copy.cameras]
    people = [Person(n, load_model(model, 1.7), "#112233") for n in names]
    return create_session(tmp_path / "other", cameras=cameras, people=people, fps=copy.fps, n_frames=copy.n_frames)


def test_the_samples_truth_as_joints(sample_folder, copy):
    reference = read_reference(sample_folder / "truth.trc", copy, 0)
    assert set(JOINTS) <= set(reference.joints.names)
    assert reference.joints.frames.tolist() == list(range(50))
    assert reference.motion is None
    points = dict(zip(reference.joints.names, reference.joints.points[0], strict=True))
    assert points["head"][2] > points["left_hip"][2] > points["left_ankle"][2] > 0
    assert points["left_hip"][1] > points["right_hip"][1]


def test_the_samples_truth_as_poses(sample_folder, copy):
    """The true skeleton stands beside the table: its joints are those of the TRC file."""
    reference = read_reference(sample_folder / "truth.csv", copy, 0)
    assert sorted(reference.motion.poses) == list(range(50))
    assert reference.motion.model.name == "gavrila22_true"
    joints, true = reference.joints, read_reference(sample_folder / "truth.trc", copy, 0).joints
    for name in ("left_wrist", "right_knee", "neck"):
        found, expected = (t.points[:, t.names.index(name)] for t in (joints, true))
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_table_whose_body_is_not_at_hand_is_of_the_persons_own(sample_folder, copy, tmp_path):
    shutil.copy(sample_folder / "truth.csv", tmp_path / "alone.csv")
    reference = read_reference(tmp_path / "alone.csv", copy, 0)
    model = copy.people[0].model
    assert reference.motion.model is model
    expected = model.points_world(reference.motion.poses[7])[model.point_names.index("left_wrist")]
    at = reference.joints.names.index("left_wrist")
    np.testing.assert_allclose(reference.joints.points[7, at], expected, atol=1e-6)
    # Bones of another length: near the true joints, not on them.
    true = read_reference(sample_folder / "truth.trc", copy, 0).joints
    off = np.linalg.norm(true.points[:, true.names.index("left_wrist")] - reference.joints.points[:, at], axis=1)
    assert 0.001 < off.mean() < 0.1


def test_a_table_of_another_presets_poses(copy, tmp_path):
    bending = load_model("gavrila34", 1.6)
    write_pose_table(tmp_path / "poses.csv", bending, bending.neutral()[None])
    found = read_reference(tmp_path / "poses.csv", copy, 0).motion
    assert (found.model.name, found.model.height_m) == ("gavrila34", 1.6)
    np.testing.assert_allclose(found.poses[0], bending.neutral(), atol=1e-9)


def test_a_table_of_a_presets_poses_has_that_presets_joints(copy, tmp_path):
    short = load_model("gavrila22", 1.2)
    write_pose_table(tmp_path / "poses.csv", short, np.tile(short.neutral(), (3, 1)))
    reference = read_reference(tmp_path / "poses.csv", copy, 0)
    at = reference.joints.names.index("left_ankle")
    np.testing.assert_allclose(
        reference.joints.points[0, at],
        short.points_world(short.neutral())[short.point_names.index("left_ankle")],
        atol=1e-6,
    )


def test_a_session_as_reference(copy, tmp_path):
    other = two_people(tmp_path, copy)
    model = other.people[1].model
    poses = {3: model.neutral(), 8: model.neutral() + np.eye(22)[0]}
    store_poses(other, poses, other.people[1])
    people = two_people(tmp_path / "mine", copy)
    for path in (other.folder, other.folder / "session.toml"):
        reference = read_reference(path, people, 1)
        assert sorted(reference.motion.poses) == [3, 8]
        np.testing.assert_array_equal(reference.motion.poses[8], poses[8])
        assert reference.joints.frames.tolist() == [3, 8]
    assert read_reference(other.folder, people, 0).motion.poses == {}  # nobody has placed ann


def test_a_session_without_the_person(copy, tmp_path):
    other = two_people(tmp_path, copy)
    with pytest.raises(SessionError, match=r"a person 'person' in .*other, found ann, bob"):
        read_reference(other.folder, copy, 0)


def test_a_single_person_may_have_another_name(copy, tmp_path):
    other = two_people(tmp_path, copy, names=("carl",))
    store_poses(other, {0: other.people[0].model.neutral()})
    assert sorted(read_reference(other.folder, copy, 0).motion.poses) == [0]


def test_stored_poses(copy):
    assert stored_motion(copy, 0).motion.poses == {}
    values = copy.people[0].model.neutral()
    store_poses(copy, {4: values, 2: values + 0.1})
    found = stored_motion(copy, 0).motion.poses
    assert sorted(found) == [2, 4]
    np.testing.assert_array_equal(found[2], values + 0.1)


def test_other_rates_and_axes(tmp_path):
    # One marker set of our own names at 50 per second, y up.
    points = np.random.default_rng(0).normal(size=(10, len(JOINTS), 3))
    write_trc(tmp_path / "joints.trc", JOINTS, points, 50.0)
    every_second = read_joints(tmp_path / "joints.trc", 25.0, axes="x,-z,y")
    assert every_second.frames.tolist() == [0, 1, 2, 3, 4]
    order = [JOINTS.index(n) for n in every_second.names]
    expected = points[::2][:, order] @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float).T
    np.testing.assert_allclose(every_second.points, expected, atol=1e-5)
    assert len(read_trc(tmp_path / "joints.trc").frames) == 10


def test_own_names_by_a_map(tmp_path):
    points = np.random.default_rng(0).normal(size=(3, 2, 3))
    write_trc(tmp_path / "joints.trc", ["A", "B"], points, 25.0)
    with pytest.raises(FormatError):
        read_joints(tmp_path / "joints.trc", 25.0)
    (tmp_path / "map.toml").write_text('left_wrist = "A"\nright_wrist = "B"\n')
    joints = read_joints(tmp_path / "joints.trc", 25.0, tmp_path / "map.toml")
    assert sorted(joints.names) == ["left_wrist", "right_wrist"]


@pytest.mark.parametrize("name", ["poses.c3d", "poses", "missing.trc", "missing.csv"])
def test_wrong_references(copy, tmp_path, name):
    with pytest.raises(FormatError, match=name):
        read_reference(tmp_path / name, copy, 0)


def test_poses_of_another_model(copy, tmp_path):
    text = (copy.folder / "models" / "person.toml").read_text()
    (tmp_path / "odd.toml").write_text(text.replace("left_elbow", "left_ellbow"))
    odd = load_model(tmp_path / "odd.toml")
    write_pose_table(tmp_path / "poses.csv", odd, odd.neutral()[None])
    with pytest.raises(FormatError, match=r"beside it as poses_model\.toml"):
        read_reference(tmp_path / "poses.csv", copy, 0)


def test_a_pose_keeps_the_body_it_was_made_with(copy):
    """A taller body for later frames moves no joint of earlier ones."""
    values = copy.people[0].model.neutral()
    store_poses(copy, {0: values, 2: values})
    taller = replace(copy.people[0], model=copy.people[0].model.with_height(2.0))
    grown = replace(copy, people=(taller,))
    store_poses(grown, {1: values})
    joints = stored_motion(grown, 0).joints
    assert joints.frames.tolist() == [0, 1, 2]
    at = joints.names.index("left_ankle")
    before, after = (
        p.model.points_world(values)[p.model.point_names.index("left_ankle")] for p in (copy.people[0], taller)
    )
    np.testing.assert_allclose(joints.points[[0, 2], at], [before, before])
    np.testing.assert_allclose(joints.points[1, at], after)


def test_joints_of_other_layouts_are_read(sample_folder, copy, tmp_path):
    """Import and evaluation read the same files; a table of poses is known by its comments."""
    table, path = read_trc(sample_folder / "truth.trc"), tmp_path / "joints.csv"
    head = ["frame", *(f"{name}_{axis}_mm" for name in table.names for axis in "xyz")]
    rows = [",".join(map(str, [k, *(1000 * p).ravel()])) for k, p in enumerate(table.points)]
    path.write_text("\n".join([",".join(head), *rows]) + "\n")
    expected = read_joints(sample_folder / "truth.trc", copy.fps)
    found = read_reference(path, copy, 0).joints
    assert found.names == expected.names
    np.testing.assert_allclose(found.points, expected.points, atol=1e-5)
