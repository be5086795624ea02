"""The body whose sizes are acquired."""

import pytest

from tracker.formats.model_toml import load_model


@pytest.fixture
def model():
    return load_model("gavrila22", 1.7)
