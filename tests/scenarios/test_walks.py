"""The walks of docs/architecture.md: each call is made, in the order in which the table has them."""

import pytest
from tracking_runs import track, with_reference
from walks import traced

import quadrille
from tracker.compute.progress import result_of
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.runs.run_estimate import RunFrames, estimate_run
from tracker.estimation.tracking.tracker import Subjects
from tracker.evidence.observer import open_observer
from tracker.formats.model_toml import load_model
from tracker.session.session import save_model
from tracker.simulate import Simulation, simulate

MAX_FILES, MAX_CROSSINGS, MAX_OF_ESTIMATE = 41, 245, 1034
"""Of a frame of one person in four views, from the pose before to its own; crossings of the estimate of all frames for
each of them. They may only fall."""


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
        subjects, poses = Subjects.of([session.people[0].model]), {}
        steps = iter(track(observer, subjects.models, [start], range(40)))
        for k in range(40):
            with walk.counted() as crossings:
                poses[k] = next(steps).poses
            frames.append(crossings)
        with walk.counted() as of_estimate:
            result_of(estimate_run(RunFrames(observer, subjects, TrackSettings(), session.fps, poses)))
    files, crossings = zip(*((len({*sum(c, ())}), c.total()) for c in frames[2:]), strict=True)
    assert min(files) <= MAX_FILES, sorted({*sum(frames[-1], ())})
    assert min(crossings) <= MAX_CROSSINGS, frames[-1].most_common(20)
    assert of_estimate.total() <= 40 * MAX_OF_ESTIMATE, of_estimate.most_common(20)
