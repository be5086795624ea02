import numpy as np
import pytest
from bodies import with_center

from tracker.body.dimensions import dimensions_of, restate_height, stature_m, with_dimensions
from tracker.formats.model_toml import load_model


@pytest.mark.parametrize("name", ["gavrila22", "gavrila22_cones", "gavrila34", "gavrila38", "knossow54"])
def test_a_preset_is_as_tall_as_its_height(name):
    assert stature_m(load_model(name, 1.6)) == pytest.approx(1.6, rel=0.01)


def test_the_height_follows_the_stature_and_the_body_stays():
    model = with_center(with_center(load_model("gavrila34", 1.6), "left_hip", (0, 0.02, -0.03)), "head", (0.01, 0, 0))
    sizes = dimensions_of(model)
    parts = {
        n: p._replace(length_m=p.length_m * (0.85 if n.endswith(("thigh", "calf")) else 1))
        for n, p in sizes.parts.items()
    }
    short = with_dimensions(model, sizes._replace(parts=parts))
    resized = restate_height(short, model)
    assert short.height_m == 1.6
    assert resized.height_m == pytest.approx(1.6 - 0.15 * 1.6 * (0.2425 + 0.2527), abs=0.02)
    pose = np.random.default_rng(0).normal(0, 0.3, model.n_dofs)
    np.testing.assert_allclose(resized.points_world(pose), short.points_world(pose))
    np.testing.assert_allclose(resized.joint_centers_world(pose), short.joint_centers_world(pose))
    np.testing.assert_allclose([s.half_axes for s in resized.shapes], [s.half_axes for s in short.shapes])
    np.testing.assert_allclose(resized.centers_part, short.centers_part)
