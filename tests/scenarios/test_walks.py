"""The walks of docs/architecture.md: each call is made, in the order in which the table has them."""

import pytest
from walks import traced

import quadrille
from tracker.formats.model_toml import load_model
from tracker.session.session import save_model
from tracker.simulate import Simulation, simulate


@pytest.mark.slow
def test_people_are_found_and_tracked_as_the_documents_say(tmp_path):
    with traced() as walk:
        session = simulate(tmp_path / "s", Simulation(n_frames=8, n_cameras=3, size=(320, 240)))
        save_model(session, 0, load_model("gavrila34"))  # of nobody's height
        for heading, work in (("Find people", quadrille.find), ("One frame", quadrille.track)):
            walk.first_calls.clear()
            with walk.counted():
                work(session.folder)
            walk.assert_documented(heading)
