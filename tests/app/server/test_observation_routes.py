"""Files that the page names to be imported, and the report of a judgement."""

import json
import math
import shutil
from contextlib import AsyncExitStack

import pytest
from observed_people import seen, true_motion, write_openpose
from serving import page_of
from unreadable_folders import refuse_folders

from app.server.copy_routes import CopyRoutes
from app.server.observation_routes import ObservationRoutes
from tracker import files
from tracker.body.model import PosedBody
from tracker.evaluation.judging.judge import Judgement, LimbVerdict
from tracker.pipeline.keypoint_evidence import read_points
from tracker.session.store.records import PoseRecord
from tracker.session.store.stored_poses import StoredPose

pytestmark = pytest.mark.usefixtures("film_once")
PLAN, IMPORT, REPORT = "/observations/plan", "/observations/import", "/observations/report"
COPY = "/copies/open"


@pytest.fixture
async def serve(controller):
    """Serve the section of the session; gives its page."""
    async with AsyncExitStack() as stack:

        async def start(refusal=None):
            routes = ObservationRoutes(controller, refusal), CopyRoutes(controller, refusal)
            return await stack.enter_async_context(page_of(*routes))

        yield start


@pytest.fixture
async def post(serve):
    return (await serve()).post


@pytest.fixture
def form(controller, tmp_path):
    """The form of files of the person whom the cameras of the session show."""
    session = controller.session
    points = seen(session, [true_motion(session)])
    folder = write_openpose(tmp_path / "found", session.camera_names, points)
    return {"paths": str(folder), "name": "net", "people": [session.people[0].name]}


async def test_files_are_described_and_then_stored(controller, form, post):
    assert (await post(IMPORT, {}))[0] == 400  # nothing was read
    status, text = await post(PLAN, form)
    assert status == 200, text
    report = json.loads(text)
    assert (report["name"], report["format"], report["problems"]) == ("net", "openpose", [])
    assert [v["view"] for v in report["views"]] == list(controller.session.camera_names)
    assert not (controller.session.folder / "observations").exists()
    assert await post(IMPORT, {}) == (200, '{"stored": true}')
    assert [s.name for s in controller.state.observations.sets] == ["net"]
    status, text = await post(PLAN, form)
    assert (status, "exists already; choose another name" in text) == (400, True), text
    assert (await post(PLAN, form | {"name": "other"}))[0] == 200
    (controller.session.folder / "observations" / "other").mkdir()  # somebody stores one of this name meanwhile
    status, text = await post(IMPORT, {})
    assert (status, "exists already; choose another name" in text) == (400, True), text
    assert [s.name for s in controller.state.observations.sets] == ["net"]


async def test_views_without_points_have_no_confidence(controller, form, tmp_path, post):
    for path in (tmp_path / "found" / controller.session.camera_names[0]).glob("*.json"):
        path.write_text('{"version": 1.3, "people": []}')
    status, text = await post(PLAN, form)
    assert status == 200, text
    assert "NaN" not in text
    confidences = [v["confidence"] for v in json.loads(text)["views"]]
    assert confidences[0] is None
    assert all(math.isfinite(c) for c in confidences[1:])


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"paths": "relative/files"}, "expected a path from the root or from ~"),
        ({"paths": "/nowhere/at/all"}, "/nowhere/at/all"),
        ({"paths": ""}, "'paths'"),
        ({"name": "../outside"}, "../outside"),
        ({"name": "a/b"}, "a/b"),
        ({"people": ["stranger"]}, "found 'stranger'"),
        ({"people": []}, "People"),
        ({"picture_size": [0, 480]}, "Picture size"),
        ({"confidence": 2}, "Confidence"),
        ({"first_frame": -10_000_001}, "First frame"),
        ({"format": "pickle"}, "format"),
    ],
)
async def test_wrong_forms_are_answered_with_the_reason(controller, form, changes, expected, post):
    status, text = await post(PLAN, form | changes)
    assert (status, expected in text) == (400, True), text
    assert controller.state.observations.plan is None
    assert not (controller.session.folder / "observations").exists()


async def test_a_folder_that_cannot_be_looked_through_is_a_reason(form, tmp_path, monkeypatch, post):
    (tmp_path / "found" / "gone").mkdir()
    with monkeypatch.context() as patch:
        refuse_folders(patch, "gone", FileNotFoundError(2, "No such file or directory"))
        status, text = await post(PLAN, form)
    assert (status, "gone cannot be (No such file or directory)" in text) == (400, True), text
    with monkeypatch.context() as patch:
        patch.setattr(files, "LIMITS", files.WalkLimits(entries=3))
        status, text = await post(PLAN, form)
    assert (status, "expected at most 3 files and folders" in text) == (400, True), text
    assert (await post(PLAN, form))[0] == 200, "nothing is held"


async def test_a_body_that_is_no_form_or_too_large_is_refused(post):
    assert (await post(PLAN, b"no JSON"))[0] == 400
    assert (await post(PLAN, b"[]"))[0] == 400
    status, _ = await post(PLAN, b" " * (4 << 20))
    assert status in (400, 413)


async def test_only_the_page_itself_may_ask(controller, serve, form):
    page = await serve()
    post = page.post
    assert (await post(PLAN, form, Origin="http://evil.example"))[0] == 403
    assert (await post(PLAN, form, **{"Sec-Fetch-Site": "cross-site"}))[0] == 403
    assert (await page.get(REPORT, **{"Sec-Fetch-Site": "cross-site"}))[0] == 403
    page.session.cookie_jar.clear()
    assert [(await post(path, form))[0] for path in (PLAN, IMPORT)] == [403, 403]
    assert (await page.get(REPORT))[0] == 403
    other = (await serve("No paths here.")).post
    assert await other(PLAN, form) == (403, "No paths here.")
    assert await other(IMPORT, {}) == (403, "No paths here.")
    assert controller.state.observations.plan is None


async def test_the_report_of_a_judgement_is_downloaded(controller, serve, form):
    page = await serve()
    status, text = await page.get(REPORT)
    assert (status, "judge imported observations first" in text) == (400, True)
    await page.post(PLAN, form)
    await page.post(IMPORT, {})
    person, points = controller.session.people[0].name, read_points(controller.session, "net")[0]
    frames = {3: {"left arm": LimbVerdict(0.98, 0.2, "left arm jumps", "left_wrist")}}
    body = controller.session.people[0].model
    pose = StoredPose(
        PosedBody(body, body.neutral()), PoseRecord(body.neutral(), ("tracked",) * len(body.neutral()), 1)
    )
    judgement = Judgement(person, frames, {}, {}, points, {3: pose})
    controller.observing._set(judged="net", judgements=(judgement,))
    async with page.session.get(REPORT) as response:
        assert response.status == 200
        assert response.headers["Content-Disposition"] == "attachment; filename*=UTF-8''session_net_judged.html"
        text = await response.text()
    assert "left arm jumps" in text
    assert text.count("data:image/jpeg;base64,") == len(controller.session.cameras)


async def test_another_copy_is_opened_by_its_path_where_paths_may_be_named(controller, serve, session, tmp_path, post):
    copy = shutil.copytree(session, tmp_path / "ben")
    refused = (await serve("no paths here")).post
    assert await refused(COPY, {"folder": str(copy)}) == (403, "no paths here")
    assert (await post(COPY, {"folder": "ben"}))[0] == 400  # neither from the root nor from the home
    assert (await post(COPY, {"folder": str(copy)}, Origin="http://elsewhere.example"))[0] == 403
    assert controller.state.other_copy is None
    assert (await post(COPY, {"folder": str(copy)}))[0] == 200
    assert controller.state.other_copy.name == "ben"
