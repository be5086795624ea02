"""Requests for thumbnails: one at a time beside everything else, bounded, and only of this page."""

import asyncio
import threading

import pytest
from serving import page_of

from app.server import thumbnails
from app.server.thumbnails import ThumbnailRoutes
from tracker.errors import RecordingError

JPEG = b"\xff\xd8 a picture"


class Maker:
    """Makes thumbnails when it is let go."""

    def __init__(self):
        self.asked, self.free, self.is_busy = [], threading.Event(), False
        self.free.set()

    def make(self, *asked):
        _person, frame, *_ = asked
        self.asked.append(asked)
        assert self.free.wait(10)
        if frame == 404:
            return None
        if frame == 500:
            raise RecordingError("the drive is away")
        return JPEG


@pytest.fixture
async def client():
    maker = Maker()
    async with page_of(ThumbnailRoutes(maker.make, lambda: maker.is_busy)) as page:
        yield page.session, maker
        maker.free.set()


async def status(session, path, **headers):
    async with session.get(path, headers=headers) as response:
        return response.status


async def test_a_thumbnail_is_sent_as_jpeg(client):
    session, maker = client
    async with session.get("/thumbnail/1/31?limb=2&v=3.5") as response:
        assert (response.status, response.content_type, await response.read()) == (200, "image/jpeg", JPEG)
    assert await status(session, "/thumbnail/0/7?blurred&v=1") == 200
    assert maker.asked == [(1, 31, 2, False), (0, 7, None, True)]
    assert await status(session, "/thumbnail/0/404") == 404
    assert await status(session, "/thumbnail/0/500") == 503
    for wrong in ("/thumbnail/x/1", "/thumbnail/0/-1", "/thumbnail/0/1?limb=a", f"/thumbnail/0/{10**12}"):
        assert await status(session, wrong) == 404
    assert await status(session, "/thumbnail/0/1", **{"Sec-Fetch-Site": "cross-site"}) == 403


async def test_nothing_waits_for_a_thumbnail(client, monkeypatch):
    session, maker = client
    monkeypatch.setattr(thumbnails, "_MAX_WAITING", 3)
    maker.free.clear()
    async with asyncio.timeout(10):
        waiting = [asyncio.create_task(status(session, f"/thumbnail/0/{frame}")) for frame in range(3)]
        while not maker.asked:
            await asyncio.sleep(0.01)
        assert await status(session, "/static/icon.svg") == 200  # the page is served meanwhile
        assert len(maker.asked) == 1  # one at a time
        assert await status(session, "/thumbnail/0/9") == 503  # too many
        maker.free.set()
        assert await asyncio.gather(*waiting) == [200] * 3
        maker.is_busy = True
        assert await status(session, "/thumbnail/0/1") == 503


async def test_a_thumbnail_that_nobody_waits_for_is_not_made(client):
    session, maker = client
    maker.free.clear()
    async with asyncio.timeout(10):
        first, second = [asyncio.create_task(status(session, f"/thumbnail/0/{frame}")) for frame in (1, 2)]
        while not maker.asked:
            await asyncio.sleep(0.01)
        second.cancel()
        await asyncio.sleep(0.1)
        maker.free.set()
        assert await first == 200
        assert await status(session, "/thumbnail/0/3") == 200
    assert [frame for _, frame, *_ in maker.asked] == [1, 3]
