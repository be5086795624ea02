"""Bodies, hulls and scenes as meshes, read back by trimesh."""

import numpy as np
import pytest
import trimesh
from bodies import MODELS
from gltf_validator import check_gltf
from stored_motions import filmed, store_motion
from true_poses import sample_with_poses

import quadrille
from tracker.errors import TrackerError
from tracker.geometry import rigid
from tracker.interchange.exports.mesh_writers import write_bodies, write_scene
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion


@pytest.fixture
def couple(tmp_path):
    """Two people with footage; ann has no pose on frame 2."""
    models = [MODELS["gavrila38"], MODELS["gavrila22"]]
    session, truth = store_motion(tmp_path / "s", models, n_frames=3, gaps={(0, 2)})
    return filmed(session, tmp_path), truth


def surface(body):
    """Vertices of the parts of a body, world."""
    model = body.model
    parts = zip(model.shapes, model.centers_part, body.kinematics.Ts_world_part, strict=True)
    return np.vstack([rigid.apply(T, shape.triangles().vertices + center) for shape, center, T in parts])


@pytest.mark.parametrize("mesh", ["ply", pytest.param("obj", marks=pytest.mark.slow), "stl", "glb"])
def test_bodies_lie_where_they_are_in_the_axes_and_unit_of_the_file(tmp_path, couple, mesh):
    session, truth = couple
    options = ExportOptions("y-up", "mm", mesh=mesh)
    write_bodies(read_motion(session, (0, 1), range(1, 3)), options, [tmp_path / "m"], lambda: None)
    assert {p.name for p in (tmp_path / "m").iterdir()} == {
        f"{n}.{mesh}" for n in ("ann_000001", "bob_000001", "bob_000002")
    }
    found = trimesh.load(tmp_path / "m" / f"bob_000002.{mesh}", force="mesh")
    expected = 1000 * rigid.apply(file_from_world(session, "y-up"), surface(truth[1][2]))
    np.testing.assert_allclose(found.bounds, [expected.min(axis=0), expected.max(axis=0)], atol=0.01)


def test_a_scene_has_bodies_and_the_pictures_of_the_cameras_where_they_see(tmp_path, couple):
    session, truth = couple
    write_scene(read_motion(session, (0, 1), [1]), ExportOptions("y-up"), [tmp_path / "a.glb"], lambda: None)
    scene, T = trimesh.load(tmp_path / "a.glb"), file_from_world(session, "y-up")
    for source in session.cameras:
        camera = source.camera.pinhole
        at, name = scene.graph[f"{camera.name}_picture"]
        picture = scene.geometry[name]
        corners = rigid.apply(rigid.inverse(T), trimesh.transform_points(picture.vertices, at))
        width, height = camera.size
        seen = np.array([(u * width, (1 - v) * height) for u, v in picture.visual.uv]) - 0.5
        np.testing.assert_allclose(camera.project(corners), seen, atol=0.02)
        assert f"{camera.name}_frustum" in scene.graph.nodes_geometry
        assert picture.visual.material.baseColorTexture.size == pytest.approx((width, height), abs=1)
    at, name = scene.graph["ann_head"]
    vertices = trimesh.transform_points(scene.geometry[name].vertices, at)
    expected = rigid.apply(T, surface(truth[0][1]))
    assert (vertices >= expected.min(axis=0) - 1e-4).all()
    assert (vertices <= expected.max(axis=0) + 1e-4).all()


@pytest.mark.slow
def test_the_khronos_validator_finds_no_error_in_bodies_and_scenes(tmp_path, couple):
    motion = read_motion(couple[0], (0, 1), [1])
    write_scene(motion, ExportOptions("y-up"), [tmp_path / "a.glb"], lambda: None)
    write_bodies(motion, ExportOptions("y-up", mesh="glb"), [tmp_path / "m"], lambda: None)
    for path in (tmp_path / "a.glb", *(tmp_path / "m").iterdir()):
        check_gltf(path)


def test_bodies_as_gltf_stand_as_it_says(tmp_path, couple):
    (folder,) = quadrille.export(couple[0], tmp_path / "m", "meshes", frames=[1], options={"mesh": "glb"})
    low, high = trimesh.load(folder / "ann_000001.glb", force="mesh").bounds
    expected = rigid.apply(file_from_world(couple[0], "y-up"), surface(couple[1][0][1]))
    np.testing.assert_allclose([low, high], [expected.min(axis=0), expected.max(axis=0)], atol=1e-5)


@pytest.mark.parametrize("option", [{"axes": "calibration"}, {"units": "mm"}])
def test_other_axes_and_units_of_gltf_are_refused(tmp_path, couple, option):
    with pytest.raises(TrackerError, match=r"expected (axes y-up|units m) of meshes as glTF, found"):
        quadrille.export(couple[0], tmp_path / "m", "meshes", options={"mesh": "glb", **option})


def test_a_scene_of_several_frames_is_refused(tmp_path, couple):
    motion = read_motion(couple[0], (0, 1))
    with pytest.raises(TrackerError, match="expected one frame for a scene, found 3"):
        write_scene(motion, ExportOptions("y-up"), [tmp_path / "a.glb"], lambda: None)


@pytest.mark.slow
def test_the_hull_encloses_the_body_that_was_filmed(tmp_path):
    session = sample_with_poses(tmp_path / "s", 10)
    (folder,) = quadrille.export(session, tmp_path / "h", "hulls", frames=[9], options={"mesh": "stl"})
    hull, joints = trimesh.load(folder / "hull1_000009.stl"), quadrille.read_poses(session, frames=[9]).joints[0]
    assert 0.05 < hull.volume < 0.2  # of the order of a person, cubic metres
    low, high = hull.bounds + np.array([[-0.05], [0.05]])  # the floor hides the soles
    assert ((low < joints) & (joints < high)).all()
