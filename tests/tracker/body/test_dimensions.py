"""Sizes of a body as people enter them: there and back, and what is refused."""

import numpy as np
import pytest
from bodies import with_center

from tracker.body.dimensions import PartDimensions, dimensions_of, mirror_part, scaled, with_dimensions
from tracker.errors import TrackerError
from tracker.formats.model_toml import PRESETS, format_model, load_model, parse_model


def points(model):
    return model.named_points_world(model.neutral())


def distance(model, a, b):
    at = points(model)
    return np.linalg.norm(at[a] - at[b])


@pytest.mark.parametrize("name", PRESETS)
def test_sizes_go_there_and_back(name):
    model = load_model(name, 1.82)
    sizes = dimensions_of(model)
    parts = {
        n: PartDimensions(p.length_m * (1 + 0.01 * i), (p.girths_m[0] * 0.9, p.girths_m[1] * 1.05))
        for i, (n, p) in enumerate(sizes.parts.items())
    }
    wanted = sizes._replace(height_m=1.7, parts=parts, widths_m={n: 1.1 * w for n, w in sizes.widths_m.items()})
    dimensions = dimensions_of(parse_model(format_model(with_dimensions(model, wanted)), "test"))
    assert dimensions.height_m == wanted.height_m
    for part, own in parts.items():
        assert dimensions.parts[part].length_m == pytest.approx(own.length_m)
        assert dimensions.parts[part].girths_m == pytest.approx(own.girths_m)
    assert dimensions.widths_m == pytest.approx(wanted.widths_m)


def test_a_length_is_the_distance_of_the_joints():
    model = load_model("gavrila34")
    sizes = dimensions_of(model)
    assert sizes.parts["left_thigh"].length_m == pytest.approx(distance(model, "left_hip", "left_knee"))
    longer = with_dimensions(
        model, sizes._replace(parts={**sizes.parts, "left_thigh": PartDimensions(0.5, (0.07, 0.08))})
    )
    assert distance(longer, "left_hip", "left_knee") == pytest.approx(0.5)
    assert distance(longer, "left_knee", "left_ankle") == pytest.approx(distance(model, "left_knee", "left_ankle"))
    assert distance(longer, "right_hip", "right_knee") == pytest.approx(distance(model, "right_hip", "right_knee"))
    assert longer.parts[longer.part_index["left_thigh"]].half_axes[:2] == pytest.approx((0.07 / 1.75, 0.08 / 1.75))
    assert sizes.widths_m == {"hip": pytest.approx(distance(model, "left_hip", "right_hip"))}


def test_another_height_keeps_the_proportions():
    model = load_model("gavrila22")
    taller = with_dimensions(model, scaled(dimensions_of(model), 1.925))
    for name, place in points(model).items():
        np.testing.assert_allclose(points(taller)[name], 1.1 * place, atol=1e-12)


@pytest.mark.parametrize(("name", "other"), [("left_calf", "right_calf"), ("right_calf", "left_calf"), ("head", None)])
def test_twins(name, other):
    assert mirror_part(name) == other


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (PartDimensions(0.0, (0.05, 0.05)), "length of left calf to be 0.5 to 122 cm, found 0"),
        (PartDimensions(4.0, (0.05, 0.05)), "found 400"),
        (PartDimensions(0.4, (-0.05, 0.05)), "girth of left calf"),
        (PartDimensions(float("nan"), (0.05, 0.05)), "found nan"),
    ],
)
def test_sizes_that_no_body_has_are_refused(part, message):
    model = load_model("gavrila22")
    sizes = dimensions_of(model)
    with pytest.raises(TrackerError, match=message):
        with_dimensions(model, sizes._replace(parts={**sizes.parts, "left_calf": part}))


@pytest.mark.parametrize("height_m", [0.0, -1.0, 17.5, float("nan")])
def test_nobody_is_that_tall(height_m):
    model = load_model("gavrila22")
    with pytest.raises(TrackerError, match="height of 30 to 300 cm"):
        with_dimensions(model, dimensions_of(model)._replace(height_m=height_m))


def test_joint_centers_scale_with_the_dimensions_of_their_part():
    model = with_center(load_model("gavrila34", 1.8), "left_hip", (0.01, 0.02, 0.03))
    model = with_center(model, "left_wrist", (0.01, 0.0, 0.0))
    sizes = dimensions_of(model)
    pelvis, forearm = sizes.parts["pelvis"], sizes.parts["left_forearm"]
    parts = dict(sizes.parts) | {
        "pelvis": PartDimensions(pelvis.length_m * 1.1, (pelvis.girths_m[0] * 1.2, pelvis.girths_m[1] * 0.9)),
        "left_forearm": PartDimensions(forearm.length_m, (forearm.girths_m[0] * 1.5, forearm.girths_m[1])),
    }
    resized = with_dimensions(model, sizes._replace(parts=parts))
    hip, wrist = (resized.point_names.index(n) for n in ("left_hip", "left_wrist"))
    np.testing.assert_allclose(resized.center_offsets[hip], 1.8 * np.array([0.012, 0.018, 0.033]))
    np.testing.assert_allclose(resized.center_offsets[wrist], 1.8 * np.array([0.015, 0.0, 0.0]))
    taller = with_dimensions(model, scaled(sizes, 0.9))
    np.testing.assert_allclose(taller.center_offsets[hip], 0.9 * np.array([0.01, 0.02, 0.03]))
