import pytest

from tracker.formats.model_toml import load_model
from tracker.simulate.people.outfit import Outfit
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin


@pytest.fixture(scope="session")
def true_model():
    return altered_model(load_model("gavrila22", 1.78))


@pytest.fixture(scope="session")
def skin(true_model):
    return make_skin(true_model, Outfit())
