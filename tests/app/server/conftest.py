"""A page that asks for other sessions."""

import json
import shutil
from contextlib import AsyncExitStack

import pytest
from command_line import SAMPLE
from serving import Page, page_of

from app.server.session_routes import SessionRoutes


@pytest.fixture
def folders(tmp_path):
    """Two sessions, and the folder of the user's state."""
    for name in ("walk", "dance"):
        shutil.copytree(SAMPLE, tmp_path / name)
    return tmp_path / "walk", tmp_path / "dance", tmp_path / "state"


class Client(Page):
    """A page that makes and opens sessions."""

    async def make(self, form):
        status, text = await self.open(form, "/sessions/new")
        assert status == 200, text
        return [json.loads(line) for line in text.splitlines()]

    async def open(self, body, path="/sessions/open", **headers):
        return await self.post(path, body, **headers)


@pytest.fixture
async def serve(folders):
    async with AsyncExitStack() as stack:

        async def start(why=None, unsaved=None):
            routes = SessionRoutes(folders[0], folders[2], why, lambda: unsaved)
            client = await stack.enter_async_context(page_of(routes, kind=Client))
            client.routes = routes
            return client

        yield start
