import numpy as np
import pytest

from tracker.formats.model_toml import load_model
from tracker.simulate.people.outfit import Outfit
from tracker.simulate.people.population import POPULATION, individual
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin


@pytest.mark.slow
@pytest.mark.parametrize("name", POPULATION)
def test_a_person_is_as_tall_as_stated(name):
    height_m, build = individual(name)
    model = altered_model(load_model("gavrila22", height_m), build.bone_factors)
    skin = make_skin(model, Outfit(), build)
    assert np.ptp(skin.posed(model.neutral())[:, 2]) == pytest.approx(height_m, rel=0.015)
