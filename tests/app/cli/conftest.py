"""A session whose person has a pose."""

import pytest
from command_line import WITH_POSE


@pytest.fixture
def placed(run, session):
    """The sample with the known pose of one frame."""
    assert run("init", session, *WITH_POSE, "--frame", "20", "--json")[0] == 0
    return session
