import numpy as np

from tracker.formats.model_toml import load_model


def bone_lengths(model):
    joints = {j.name: np.linalg.norm(j.position) for j in model.joints if j.parent}
    return joints | {m.name: np.linalg.norm(m.position) for m in model.landmarks}


def test_every_bone_differs_by_five_percent_and_not_all_one_way(true_model):
    true, preset = bone_lengths(true_model), bone_lengths(load_model("gavrila22"))
    ratios = np.array([true[name] / preset[name] for name in preset])
    assert np.abs(ratios - 1.0).min() >= 0.05, dict(zip(preset, ratios, strict=True))
    assert np.sum(ratios > 1) >= 3
    assert np.sum(ratios < 1) >= 3


def test_the_body_keeps_its_height_and_its_degrees_of_freedom(true_model):
    preset = load_model("gavrila22", true_model.height_m)
    assert true_model.dof_names == preset.dof_names
    extents = []
    for model in (preset, true_model):
        points = model.named_points_world(model.neutral())
        extents.append(points["head"][2] - points["left_ankle"][2])
    assert np.isclose(*extents, rtol=0.01)
