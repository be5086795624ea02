"""A body with another root is the same body: every point, shape and limit stays."""

import numpy as np
import pytest
from bodies import MODELS, with_center
from staging import posed

from tracker.body.reroot import reroot, reroot_pose
from tracker.errors import TrackerError
from tracker.formats.model_toml import format_model, load_model, parse_model

CASES = [(name, part) for name in ("knossow54", "balls") for part in MODELS[name].part_index] + [
    ("gavrila34", "left_calf"),
    ("gavrila22", "head"),
]


def placed(model, values):
    """World position and rotation of each shape, and position of each point, by name."""
    Ts = model.kinematics(values).Ts_world_part
    centers = np.einsum("nij,nj->ni", Ts[:, :3, :3], model.centers_part) + Ts[:, :3, 3]
    shapes = {p.name: (c, T[:3, :3]) for p, c, T in zip(model.parts, centers, Ts, strict=True)}
    return shapes, model.named_points_world(values)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "part"), CASES)
def test_any_part_may_be_the_root(name, part):
    model = MODELS[name]
    found = reroot(model, part)
    assert found.joints[0].child == part
    assert found.n_dofs == model.n_dofs
    for seed in range(5):
        values = posed(model, seed)
        shapes, points = placed(model, values)
        own = reroot_pose(model, values, found)
        shapes_found, points_found = placed(found, own)
        for n, (center, R) in shapes.items():
            np.testing.assert_allclose(shapes_found[n][0], center, atol=1e-9)
            np.testing.assert_allclose(shapes_found[n][1], R, atol=1e-9)
        for n in set(points) & set(points_found):
            np.testing.assert_allclose(points_found[n], points[n], atol=1e-9)
        assert set(points) - set(points_found) <= {model.joints[0].name}
        np.testing.assert_allclose(found.clip(own), own, atol=1e-9)  # the limits are the same


@pytest.mark.parametrize("name", ["knossow54", "balls"])
def test_and_back_again(name):
    model = MODELS[name]
    far = reroot(model, model.parts[-1].name)
    back = reroot(far, model.joints[0].child)
    values = posed(model, 1)
    there = reroot_pose(far, reroot_pose(model, values, far), back)
    Ts, Ts_back = model.kinematics(values).Ts_world_part, back.kinematics(there).Ts_world_part
    for p, i in model.part_index.items():
        np.testing.assert_allclose(Ts_back[back.part_index[p], :3, :3], Ts[i, :3, :3], atol=1e-9)


def test_a_model_file_keeps_another_root():
    found = reroot(load_model("knossow54", 1.7), "left_forearm")
    assert parse_model(format_model(found), "x").dof_names == found.dof_names
    assert {d for g in found.search_groups for d in g.dofs} == set(found.dof_names)


def test_refused_roots():
    model = MODELS["knossow54"]
    with pytest.raises(TrackerError, match=r"expected one of the parts torso, .* found 'tail'"):
        reroot(model, "tail")
    with pytest.raises(TrackerError, match="found one of 'left_hip'; leave it out"):
        reroot(with_center(model, "left_hip", (0, 0.01, 0)), "left_thigh")
