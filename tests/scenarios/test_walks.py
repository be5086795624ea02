"""The walks of docs/architecture.md: each call is made, in the order in which the table has them."""

import pytest
from tracking_runs import track, with_reference
from walks import traced

import quadrille
from tracker.evidence.observer import open_observer
from tracker.formats.model_toml import load_model
from tracker.session.session import save_model
from tracker.simulate import Simulation, simulate

MAX_FILES, MAX_CROSSINGS = 41, 245
"""Of a frame of one person in four views, from the pose before to its own; they may only fall."""


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


@pytest.mark.slow
def test_a_tracked_frame_passes_few_files(data_folder, tmp_path):
    sides, frames = ("background", "masks"), []
    session, _, start = with_reference(data_folder("walk"), tmp_path / "s", sides=sides, heights=1.75)
    with traced() as walk, open_observer(session.cameras) as observer:
        steps = iter(track(observer, [session.people[0].model], [start], range(9)))
        for _ in range(9):
            with walk.counted() as crossings:
                next(steps)
            frames.append(crossings)
    files, crossings = zip(*((len({*sum(c, ())}), c.total()) for c in frames[2:]), strict=True)
    assert min(files) <= MAX_FILES, sorted({*sum(frames[-1], ())})
    assert min(crossings) <= MAX_CROSSINGS, frames[-1].most_common(20)
