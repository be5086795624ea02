import numpy as np
import pytest
import trimesh

from tracker.geometry import rigid
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.anatomy import ANKLE_HEIGHT, bone_names
from tracker.simulate.people.skin import rest_values


def winding_number(mesh, point):
    """How often a closed mesh encloses a point: its solid angle over 4 pi (Van Oosterom & Strackee 1983)."""
    a, b, c = (mesh.triangles - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a))]
    return np.sum(2 * np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)) / (4 * np.pi)


@pytest.mark.slow
def test_the_skin_is_one_closed_surface_of_a_persons_size(skin):
    mesh = trimesh.Trimesh(skin.vertices_rest, skin.faces, process=False)
    assert mesh.is_watertight
    assert mesh.body_count == 1
    assert 0.06 < mesh.volume < 0.095  # a man of 1.78 m weighs 60 to 95 kg
    assert np.isclose(np.ptp(skin.vertices_rest[:, 2]), skin.model.height_m, rtol=0.03)


def test_the_rest_pose_gives_the_rest_vertices(skin):
    assert np.allclose(skin.posed(rest_values(skin.model)), skin.vertices_rest, atol=1e-9)


def test_a_moved_root_moves_the_skin_rigidly(skin):
    values = rest_values(skin.model)
    values[:6] = (0.3, -0.2, 1.0, 0.0, 0.0, 0.7)
    T = rigid.transform(rigid.so3_exp(np.array([0, 0, 0.7])), values[:3])
    assert np.allclose(skin.posed(values), rigid.apply(T, skin.vertices_rest), atol=1e-6)


def test_weights_sum_to_one_and_do_not_leak_from_limb_to_limb(skin):
    assert np.allclose(skin.weights.sum(axis=1), 1.0)
    bones = bone_names(skin.model)
    on_forearm = skin.weights[:, bones.index("left_forearm")] > 0.5
    strangers = [i for i, name in enumerate(bones) if "thigh" in name or "right" in name]
    assert skin.weights[on_forearm][:, strangers].max() < 1e-6


@pytest.mark.slow
def test_joints_stay_within_the_skin_and_its_volume_within_a_tenth(skin):
    rest = trimesh.Trimesh(skin.vertices_rest, skin.faces, process=False).volume
    poses = solve_posture(cast_of("elbow_rotation")[0], skin.model, 50, 25.0)
    for values in (poses[0], poses[24], poses[49]):
        mesh = trimesh.Trimesh(skin.posed(values), skin.faces, process=False)
        assert abs(mesh.volume / rest - 1.0) < 0.1
        for name, point in zip(skin.model.point_names, skin.model.points_world(values), strict=True):
            assert winding_number(mesh, point) > 0.99, name


def test_the_soles_stand_on_the_floor(skin):
    values = solve_posture(cast_of("elbow_rotation")[0], skin.model, 1, 25.0)[0]
    height = skin.model.height_m
    lowest = skin.posed(values)[:, 2].min()
    assert abs(lowest) < 0.12 * ANKLE_HEIGHT * height
