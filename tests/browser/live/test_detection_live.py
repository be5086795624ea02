"""From footage without backgrounds to tracked people by one button, with a detector that knows the truth."""

import shutil

import numpy as np
import pytest
from page_driver import command, shows
from program import ROOT, SAMPLE, started, visited

from tracker.evaluation.references import read_joints
from tracker.interchange.observations.stored import list_observations
from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses

pytestmark = pytest.mark.slow

N_FRAMES = 12


@pytest.fixture
def session(tmp_path):
    """The first frames of the sample, without its backgrounds."""
    folder = shutil.copytree(SAMPLE, tmp_path / "session")
    toml, text = folder / "session.toml", (folder / "session.toml").read_text("utf-8")
    for name in ("FRONT", "RIGHT", "BACK", "LEFT"):
        text = text.replace(f', background = "background/{name}.png"', "")
    toml.write_text(text.replace("n_frames = 50", f"n_frames = {N_FRAMES}"), "utf-8")
    return load_session(folder)


async def test_people_are_detected_found_and_tracked_by_one_button(browser, session):
    main = (str(ROOT / "tests" / "support" / "detecting_program.py"),)
    async with started(session.folder, main=main) as program, visited(browser, program.address) as page:
        find = page.locator("[data-section=find]")
        await command(page, "Inspector: sizes, settings (toggle)")
        await page.evaluate("document.querySelector('[data-section=find]').open = true")
        await find.get_by_text("No camera has a background").wait_for()
        await find.get_by_role("button", name="Detect and track").click()
        await shows(page, "quadrille.state.layers.shown.imported")
        await find.get_by_text("Done.").wait_for(timeout=240_000)
        await find.get_by_text("by key points").wait_for()
    assert list_observations(session) == ["detected"]
    person = session.people[0]
    model = load_session(session.folder).people[0].model
    poses = read_stored_poses(session.annotations_path, person.name, model, range(N_FRAMES))
    truth = read_joints(SAMPLE / "truth.trc", session.fps)
    shared = [name for name in model.point_names if name in truth.names]
    true_world = truth.points[:N_FRAMES, [truth.names.index(name) for name in shared]]
    found_world = [poses[k].body.points_world[[model.point_names.index(n) for n in shared]] for k in range(N_FRAMES)]
    assert len(shared) > 8
    assert np.linalg.norm(found_world - true_world, axis=-1).mean() < 0.03
