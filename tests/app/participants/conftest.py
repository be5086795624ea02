"""Two people on one session."""

import pytest

from app.participants.participants import Participants


@pytest.fixture
def people(opened):
    """Nobody but the host, whose name is anna."""
    host = opened()
    saver = host.session_state.saver
    saver._author = saver.moves._author = "anna"  # as if named on the command line
    people = Participants(host)
    yield people
    people.close()


@pytest.fixture
def anna(people):
    """The host's controller."""
    people.join("host")
    return people.host


@pytest.fixture
def ben(people, anna):
    """The controller of somebody who joined after anna."""
    return people.join("annotate", "ben").controller
