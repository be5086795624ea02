"""Footage that cannot be read while pages look at it."""

from itertools import groupby

import pytest
from page_visits import visiting

from app.control.session import footage_scan
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.session.session import load_session

FRONT = "FRONT.mp4"


@pytest.fixture
def observer(session):
    """The footage of this test's own session."""
    cameras = load_session(session).cameras
    recording = Recording(cameras)
    yield Observer(cameras, recording)
    recording.close()


@pytest.fixture
def controller(placed, monkeypatch):
    monkeypatch.setattr(footage_scan, "_RETRY_S", 0.1)
    return placed


async def pictures(page, frame):
    """The picture of each camera of a frame."""
    found = {}
    while len(found) < 4:
        message = await page.hear("image", lambda m: m["frame"] == frame)
        found[message["camera"]] = message["payload"]
    return found


async def state(page, condition):
    """Wait until the newest state fulfils a condition, which it may have done already."""
    newest = next((m for m in reversed(page.told) if m["type"] == "state"), None)
    if newest is None or not condition(newest):
        await page.hear("state", condition)


def damages(page):
    """What the line has said of damaged footage, without repetitions; None where it said nothing of it."""
    said = (m["said"] for m in page.told if m["type"] == "advice")
    texts = (next((a["text"] for a in of if a["situation"] == "damaged"), None) for of in said)
    return [text for text, _ in groupby(texts)]


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["truncated", "removed", "emptied"])
async def test_a_video_that_cannot_be_read_is_said_until_it_is_back(controller, session, damage):
    video = session / FRONT
    async with visiting(controller) as page:
        await pictures(page, 2)
        if damage == "removed":
            video.rename(session / "elsewhere.mp4")
        else:
            whole = video.read_bytes()
            video.write_bytes(whole[:3000] if damage == "truncated" else b"")
        placeholders = set()
        for frame in (30, 31, 40, 8):
            await page.send("seek", frame=frame)
            seen = await pictures(page, frame)
            placeholders.add(seen[0])
            assert seen[0] not in (seen[1], seen[2], seen[3])
        assert len(placeholders) == 1
        if damages(page)[-1:] in ([], [None]):
            await page.hear("advice", lambda m: m["said"] and m["said"][0]["situation"] == "damaged")
        await page.send("select", person=0, point="head")  # the socket is as it was
        await state(page, lambda m: m["point"] == "head")
        none, text = damages(page)
        assert (none, FRONT in text) == (None, True)
        if damage == "removed":
            (session / "elsewhere.mp4").rename(video)
        else:
            video.write_bytes(whole)
        assert (await pictures(page, 8))[0] not in placeholders  # without a word of the user
        await page.hear("advice", lambda m: not any(a["situation"] == "damaged" for a in m["said"]))
        assert damages(page) == [None, text, None]


@pytest.mark.slow
async def test_a_drive_that_is_gone_is_said_once_for_all_cameras(controller, session):
    async with visiting(controller) as page:
        await pictures(page, 2)
        for name in ("FRONT", "RIGHT", "BACK", "LEFT"):
            (session / f"{name}.mp4").rename(session / f"{name}.gone")
        await page.send("seek", frame=40)
        await pictures(page, 40)
        await page.hear("advice", lambda m: "3 others" in m["said"][0]["text"])
        text = damages(page)[-1]
        assert "put it back" in text
        for name in ("FRONT", "RIGHT", "BACK", "LEFT"):
            (session / f"{name}.gone").rename(session / f"{name}.mp4")
        await page.hear("advice", lambda m: not any(a["situation"] == "damaged" for a in m["said"]))


async def test_a_search_on_a_frame_that_cannot_be_read_says_why(controller, session):
    (session / FRONT).rename(session / "elsewhere.mp4")
    async with visiting(controller) as page:
        await page.send("seek", frame=40)
        await pictures(page, 40)
        await page.send("search", action="frame", person=None)
        await state(page, lambda m: "not there any more" in m["job"]["message"] and not m["job"]["running"])
