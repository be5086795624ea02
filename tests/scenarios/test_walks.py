"""The walks of docs/architecture.md: each call is made, in the order in which the table has them; a frame's is short."""

import pytest
from tracking_runs import track
from walks import traced

import quadrille
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.session.assemble import NewSession, assemble
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
    folder, frames = data_folder("walk"), []
    videos, sides = sorted(folder.glob("*.mp4")), {"background": folder / "background", "masks": folder / "masks"}
    session = assemble(NewSession(tmp_path / "s", folder / "Calib.toml", videos, heights=1.75, **sides))
    model, reference = session.people[0].model, read_joints(folder / "ground_truth.trc", session.fps)
    places = dict(zip(reference.names, reference.points[0], strict=True))
    start = fit_to_points(model, {n: places[n] for n in LIMB_JOINTS}).pose
    with traced() as walk, open_observer(session.cameras) as observer:
        steps = iter(track(observer, [model], [start], range(9), TrackSettings()))
        for _ in range(9):
            with walk.counted() as crossings:
                next(steps)
            frames.append(crossings)
    files, crossings = zip(*((len({*sum(c, ())}), c.total()) for c in frames[2:]), strict=True)
    assert min(files) <= MAX_FILES, sorted({*sum(frames[-1], ())})
    assert min(crossings) <= MAX_CROSSINGS, frames[-1].most_common(20)
