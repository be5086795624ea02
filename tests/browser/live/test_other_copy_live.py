"""Two annotators in the page: a copy is opened, its difference gone to, the mean taken, and its origin named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from page_driver import command, shows
from program import SAMPLE, started, visited

from tracker.estimation.posing.default_pose import default_pose
from tracker.evaluation.agreement.copies import mean_pose
from tracker.formats.model_toml import format_model
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

pytestmark = pytest.mark.slow

FRAME = 3


@pytest.fixture
def copies(tmp_path):
    """Folders of anna's and ben's copies: one keyframe each, ben's with a raised arm; and the mean of both."""
    anna = shutil.copytree(SAMPLE, tmp_path / "anna")
    session = load_session(anna)
    model = session.people[0].model
    own = default_pose(model, [c.camera for c in session.cameras], np.eye(3), 0.0)
    other = own.copy()
    other[model.value_names.index("left_shoulder.elevation")] += 0.5
    with AnnotationStore(anna / "annotations.sqlite") as store:
        revision = store.add_model_revision("person", format_model(model))
        record = PoseRecord(own, ("manual",) * len(own), revision, keyframe=True)
        store.commit("anna", [PoseChange("person", FRAME, record)], author="anna")
    ben = shutil.copytree(anna, tmp_path / "ben")
    with AnnotationStore(ben / "annotations.sqlite") as store:
        store.commit("ben", [PoseChange("person", FRAME, replace(record, values=other))], author="ben")
    return anna, ben, mean_pose(model, [own, other])


async def test_the_mean_of_two_copies_is_taken_and_undone(browser, copies):
    anna, ben, mean = copies
    async with (
        started(anna, "--annotator", "carl", has_token=True) as program,
        visited(browser, program.address) as page,
    ):
        await command(page, "Inspector: sizes, settings (toggle)")
        section = page.locator("[data-section=copy]")
        await page.evaluate("document.querySelector('[data-section=copy]').open = true")
        await section.get_by_label("Folder", exact=True).fill(str(anna.parent / "nobody"))
        await section.get_by_role("button", name="Compare", exact=True).click()
        await section.get_by_text("is not a session").wait_for()
        page.errors.clear()  # the browser reports the refusal, too
        await section.get_by_label("Folder", exact=True).fill(str(ben))
        await section.get_by_role("button", name="Compare", exact=True).click()
        await section.get_by_text("1 differs by more than the tolerance").wait_for()
        await section.locator(".observed-worst button").click()
        await shows(page, f"quadrille.state.shown?.frame === {FRAME}")
        await shows(page, "quadrille.state.overlay.paths.some(({ kind, count }) => kind === 'other_copy' && count)")
        await section.get_by_role("button", name="Mean", exact=True).click()
        await section.get_by_text("1 decided").wait_for()
        await page.evaluate("document.querySelector('[data-section=provenance]').open = true")
        provenance = page.locator("[data-section=provenance]")
        await provenance.get_by_text("Taken from the mean of anna and ben", exact=True).wait_for()
        await provenance.get_by_text("Keyframe by carl").wait_for()
        with AnnotationStore(anna / "annotations.sqlite", read_only=True) as store:
            np.testing.assert_allclose(store.pose("person", FRAME).values, mean, atol=1e-9)
        await page.keyboard.press("Control+z")
        await provenance.get_by_text("Keyframe by anna").wait_for()
        await section.get_by_text("1 differs by more than the tolerance.").wait_for()
