"""Sizes as parameters: zero is the body itself, derivatives are those of differences, sides are alike if coupled."""

import numpy as np
import pytest

from tracker.body.dimensions import dimensions_of
from tracker.estimation.acquisition.size_parameters import SizeArrays, SizeParameters, SizePriors
from tracker.formats.model_toml import PRESETS, format_model, load_model, parse_model

each_model = pytest.mark.parametrize("name", PRESETS)


def drawn(parameters, seed=0, share=0.7):
    return share * np.random.default_rng(seed).normal(size=len(parameters.names)) * parameters.sigmas


@pytest.mark.parametrize("coupled", [True, False])
def test_the_anatomical_prior_is_tighter_for_limbs_and_soles(coupled):
    parameters = SizeParameters(load_model("gavrila34", 1.7), coupled, SizePriors().anatomical())
    sigmas, side = dict(zip(parameters.names, parameters.sigmas, strict=True)), "" if coupled else "right_"
    priors = parameters.priors
    for joint in ("hip", "knee", "shoulder", "elbow"):
        assert sigmas[f"{side}{joint}.joint_x"] == priors.limb_joint < sigmas["waist.joint_x"] == priors.joint
    for part in ("thigh", "calf", "upper_arm", "forearm"):
        assert sigmas[f"{side}{part}.side_y"] == priors.limb_side < sigmas["torso.side_x"] == priors.side
    assert sigmas[f"{side}calf.free_end"] == priors.sole < sigmas[f"{side}forearm.free_end"] == priors.free_end
    # They are free in the same rounds as the others of their kind.
    assert parameters.of_kinds("joint")[parameters.names.index(f"{side}hip.joint_y")]
    assert parameters.of_kinds("side")[parameters.names.index(f"{side}calf.side_y")]


@each_model
def test_zero_is_the_body_itself(name):
    model = load_model(name, 1.7)
    parameters = SizeParameters(model)
    same = parameters.body(np.zeros(len(parameters.names)))
    for own, other in zip(SizeParameters(same)._base, parameters._base, strict=True):
        np.testing.assert_allclose(own, other, atol=1e-12)
    assert same.height_m == pytest.approx(model.height_m)


@pytest.mark.slow
@each_model
@pytest.mark.parametrize("coupled", [True, False])
def test_derivatives_are_those_of_differences(name, coupled):
    parameters = SizeParameters(load_model(name, 1.7), coupled)
    sizes, h = drawn(parameters), 1e-6
    found = parameters.derivatives(sizes)
    for field in SizeArrays._fields:
        sides = [[getattr(parameters.arrays(sizes + s * h * e), field) for e in np.eye(len(sizes))] for s in (1, -1)]
        numeric = np.moveaxis((np.array(sides[0]) - np.array(sides[1])) / (2 * h), 0, -1)
        np.testing.assert_allclose(getattr(found, field), numeric, atol=1e-8)


@each_model
def test_arrays_are_those_of_the_body(name):
    parameters = SizeParameters(load_model(name, 1.7))
    sizes = drawn(parameters)
    arrays, body = parameters.arrays(sizes), parameters.body(sizes)
    np.testing.assert_allclose(arrays.centers, body.centers_part)
    np.testing.assert_allclose(arrays.half_axes, [s.half_axes for s in body.shapes])
    np.testing.assert_allclose(arrays.joints[1:], body.tree.offsets[1:])
    np.testing.assert_allclose(arrays.landmarks, body.points_part[len(body.joints) :])


@each_model
def test_coupled_sides_are_mirror_images(name):
    parameters = SizeParameters(load_model(name, 1.7))
    body = parameters.body(drawn(parameters))
    points = body.named_points_world(body.neutral())
    for point, position in points.items():
        if point.startswith("left_"):
            mirrored = points[point.replace("left_", "right_")]
            np.testing.assert_allclose(position * (1, -1, 1), mirrored, atol=1e-9)
    sizes = dimensions_of(body).parts
    np.testing.assert_allclose(sizes["left_thigh"].girths_m, sizes["right_thigh"].girths_m)


def test_sides_differ_if_not_coupled():
    parameters = SizeParameters(load_model("gavrila34"), coupled=False)
    sizes = np.zeros(len(parameters.names))
    sizes[parameters.names.index("left_forearm.length")] = 0.1
    found = dimensions_of(parameters.body(sizes)).parts
    assert found["left_forearm"].length_m > 1.05 * found["right_forearm"].length_m


def test_a_free_end_moves_the_flesh_and_leaves_the_joint_end():
    model = load_model("gavrila34", 1.0)
    parameters = SizeParameters(model)
    sizes = np.zeros(len(parameters.names))
    sizes[parameters.names.index("forearm.free_end")] = 0.05
    before, after = (m.parts[m.part_index["left_forearm"]] for m in (model, parameters.body(sizes)))
    assert after.center[2] + after.half_axes[2] == pytest.approx(before.center[2] + before.half_axes[2])
    assert after.center[2] - after.half_axes[2] == pytest.approx(before.center[2] - before.half_axes[2] - 0.05)


def test_an_acquired_body_can_be_stored():
    parameters = SizeParameters(load_model("gavrila34", 1.7))
    body = parameters.body(drawn(parameters))
    assert format_model(parse_model(format_model(body), "test")) == format_model(body)


def test_the_trunk_tapers_both_ways_and_does_not_shift_sideways():
    names = SizeParameters(load_model("gavrila34")).names
    assert {"torso.taper_x", "torso.taper_y", "pelvis.taper_y"} <= set(names)
    assert not {"torso.side_y", "neck.joint_y"} & set(names)
    assert {"thigh.side_y", "hip.joint_y"} <= set(names)
