"""Typical proportions: the preset's for grown people whatever a body's sizes are, a child's below."""

import numpy as np
import pytest

from tracker.body.dimensions import dimensions_of, stature_m, with_dimensions
from tracker.estimation.acquisition.size_parameters import typical_body
from tracker.formats.model_toml import PRESETS, load_model, parse_model

each_model = pytest.mark.parametrize("name", PRESETS)
LEGS = ("left_thigh", "right_thigh", "left_calf", "right_calf")


def with_part(model, name, by):
    sizes = dimensions_of(model)
    own = sizes.parts[name]
    return with_dimensions(model, sizes._replace(parts={**sizes.parts, name: own._replace(length_m=by * own.length_m)}))


@each_model
def test_a_grown_body_has_the_proportions_of_its_preset(name):
    preset = load_model(name, 1.7)
    assert typical_body(preset) is preset
    found = typical_body(with_part(preset, "left_thigh", 1.2))
    assert dimensions_of(found) == dimensions_of(preset)


@pytest.mark.parametrize(
    "name", ["gavrila38", *(pytest.param(n, marks=pytest.mark.slow) for n in PRESETS if n != "gavrila38")]
)
def test_a_child_has_shorter_legs_and_a_larger_head(name):
    legs, heads = [], []
    for height_m in (1.0, 1.2, 1.35, 1.4):
        preset = load_model(name, height_m)
        child = typical_body(preset)
        assert child.height_m == height_m
        assert stature_m(child) == pytest.approx(stature_m(preset), rel=1e-3)
        before, after = dimensions_of(preset).parts, dimensions_of(child).parts
        legs.append([after[n].length_m / before[n].length_m for n in LEGS])
        heads.append(after["head"].length_m / before["head"].length_m)
        assert after["head"].girths_m[0] / before["head"].girths_m[0] == pytest.approx(heads[-1])
        others = set(before) - {*LEGS, "head"}
        assert all(after[n].length_m == pytest.approx(before[n].length_m) for n in others)
        # The proportions of a body that was fitted before do not matter.
        assert dimensions_of(typical_body(child)) == dimensions_of(child)
    assert np.ptp(legs, axis=1).max() < 1e-9
    assert np.all(np.diff(legs, axis=0) > 0)
    assert np.all(np.diff(heads) < 0)
    assert legs[-1] == pytest.approx([1.0] * 4)
    assert heads[-1] == pytest.approx(1.0)
    # Snyder et al. 1977: the head of a child of three years is up to one and a half times as large a share.
    assert 1.3 < heads[0] < 1.5


def test_a_body_of_no_preset_stays():
    text = """
    version = 1
    name = "own"
    height_m = 1.0
    parts = [{ name = "solid", half_axes = [0.1, 0.1, 0.5] }]
    search = [{ name = "all", dofs = ["root.*"] }]
    [[joints]]
    name = "root"
    child = "solid"
    free = true
    axes = [{ name = "turn", axis = [0, 0, 1] }]
    """
    own = parse_model(text, "own")
    assert typical_body(own) is own
