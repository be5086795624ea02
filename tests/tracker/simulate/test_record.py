import numpy as np
import pytest

from tracker.errors import SessionError, TrackerError
from tracker.footage.image_file import read_image
from tracker.footage.video import open_footage
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table
from tracker.formats.trc import read_trc
from tracker.session.session import load_session
from tracker.simulate.record import Simulation, simulate

SIZE = (160, 120)
ARGUMENTS = {"n_cameras": 2, "n_frames": 12, "size": SIZE}
LIMB_JOINTS = {f"{s}_{j}" for s in ("left", "right") for j in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("simulated") / "small"
    simulate(out, Simulation(**ARGUMENTS, masks=True))
    return out


@pytest.mark.slow
def test_the_session_loads_with_all_its_footage(folder):
    session = load_session(folder)
    assert (session.n_frames, session.fps, session.up) == (12, 25.0, "z")
    assert [c.camera.name for c in session.cameras] == ["cam1", "cam2"]
    (person,) = session.people
    assert person.model.joints == load_model("gavrila22").joints
    for source in session.cameras:
        footage = open_footage(source.footage, source.camera.name)
        assert (footage.n_frames, footage.size, footage.fps) == (12, SIZE, 25.0)
        assert read_image(source.background, "background").shape == (SIZE[1], SIZE[0], 3)
        assert len(list(source.masks.glob("*.png"))) == 12


@pytest.mark.slow
def test_true_joints_project_into_the_masks(folder):
    truth = read_trc(folder / "truth.trc")
    assert set(truth.names) == LIMB_JOINTS | {"neck", "head"}
    for source in load_session(folder).cameras:
        for k in range(12):
            mask = read_image(source.masks / f"{k:06d}.png", "mask")[..., 0]
            px = np.rint(source.camera.project(truth.points[k])).astype(int)
            # The ankles of a person 50 px high are a pixel wide.
            near = [mask[v - 1 : v + 2, u - 1 : u + 2].any() for u, v in px]
            assert all(near), [n for n, hit in zip(truth.names, near, strict=True) if not hit]


@pytest.mark.slow
def test_poses_and_skeleton_give_the_joints_and_bones_keep_their_length(folder):
    model = load_model(folder / "truth_model.toml")
    truth = read_trc(folder / "truth.trc")
    poses = read_pose_table(folder / "truth.csv").values_for(model)
    assert len(poses) == 12
    index = [model.point_names.index(name) for name in truth.names]
    for points, values in zip(truth.points, poses, strict=True):
        assert np.allclose(model.points_world(values)[index], points, atol=1e-5)
    at = {name: truth.points[:, i] for i, name in enumerate(truth.names)}
    preset = load_model("gavrila22", model.height_m)
    generic = preset.named_points_world(preset.neutral())
    for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
        for side in ("left", "right"):
            lengths = np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=1)
            assert np.ptp(lengths) < 1e-4
            assert abs(lengths[0] / np.linalg.norm(generic[f"{side}_{a}"] - generic[f"{side}_{b}"]) - 1.0) > 0.05


@pytest.mark.slow
def test_the_footage_shows_the_person_against_the_background(folder):
    source = load_session(folder).cameras[0]
    frame = open_footage(source.footage, "cam1").read(8).astype(int)
    background = read_image(source.background, "background").astype(int)
    mask = read_image(source.masks / "000008.png", "mask")[..., 0] == 1
    change = np.abs(frame - background).max(axis=-1)
    assert np.median(change[mask]) > 15
    assert np.median(change[~mask]) < 6
    # The background has noise of its own.
    assert change[~mask].std() > 0.5


@pytest.mark.slow
def test_the_same_arguments_give_the_same_bytes_and_another_seed_others(folder, tmp_path):
    again, other = tmp_path / "small", tmp_path / "other"
    simulate(again, Simulation(**ARGUMENTS, masks=True))
    simulate(other, Simulation(**(ARGUMENTS | {"n_frames": 1, "seed": 1})))
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        assert path.read_bytes() == (again / path.relative_to(folder)).read_bytes(), path
    first, second = (read_image(f / "background" / "cam1.png", "") for f in (folder, other))
    assert not np.array_equal(first, second)


@pytest.mark.slow
def test_the_fitted_body_can_be_filmed_itself(tmp_path):
    simulate(tmp_path / "s", Simulation(**(ARGUMENTS | {"n_frames": 2}), body="model"))
    true, preset = load_model(tmp_path / "s" / "truth_model.toml"), load_model("gavrila22", 1.78)
    assert true.joints == preset.joints
    assert true.parts == preset.parts


@pytest.mark.slow
def test_progress_counts_images(tmp_path):
    calls = []
    simulate(tmp_path / "s", Simulation(**(ARGUMENTS | {"n_frames": 2})), progress=lambda *call: calls.append(call))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]


@pytest.mark.slow
def test_two_people_have_truth_each_and_masks_by_person(tmp_path):
    session = simulate(tmp_path / "s", Simulation(**(ARGUMENTS | {"n_frames": 1}), scene="tango", masks=True))
    assert session.uid, "copies can be merged"
    assert [p.name for p in session.people] == ["man", "woman"]
    assert len({p.color for p in session.people}) == 2
    for k, person in enumerate(session.people):
        true = load_model(tmp_path / "s" / f"truth_{person.name}_model.toml")
        assert true.height_m == person.model.height_m
        assert true.joints != person.model.joints
        (values,) = read_pose_table(tmp_path / "s" / f"truth_{person.name}.csv").values_for(true)
        truth = read_trc(tmp_path / "s" / f"truth_{person.name}.trc")
        index = [true.point_names.index(name) for name in truth.names]
        assert np.allclose(true.points_world(values)[index], truth.points[0], atol=1e-5)
        for source in session.cameras:
            mask = read_image(source.masks / "000000.png", "mask")[..., 0]
            assert set(np.unique(mask)) == {0, 1, 2}
            own = np.argwhere(mask == k + 1).mean(axis=0)[::-1]
            assert np.linalg.norm(own - source.camera.project(truth.points[0]).mean(axis=0)) < 8


def test_an_interrupted_run_leaves_nothing(tmp_path):
    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(tmp_path / "s", Simulation(**(ARGUMENTS | {"n_frames": 1, "size": (80, 60)})), progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_use_is_not_touched(tmp_path):
    (tmp_path / "note.txt").write_text("mine")
    with pytest.raises(SessionError, match="not an empty folder"):
        simulate(tmp_path, Simulation(**ARGUMENTS))
    assert [p.name for p in tmp_path.iterdir()] == ["note.txt"]


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ({"scene": "opera"}, "'opera'"),
        ({"n_frames": 0}, "found 0"),
        ({"body": "wax"}, "'wax'"),
        ({"fps": 0.0}, "and 0"),
    ],
)
def test_impossible_arguments_are_refused_before_anything_is_written(tmp_path, argument, message):
    with pytest.raises(TrackerError, match=message):
        simulate(tmp_path / "s", Simulation(**(ARGUMENTS | argument)))
    assert list(tmp_path.iterdir()) == []
