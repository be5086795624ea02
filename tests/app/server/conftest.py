"""A page that asks for other sessions."""

import json
import shutil

import aiohttp
import pytest
from command_line import SAMPLE
from serving import listening

from app.server import server
from app.server.access import Access
from app.server.session_routes import SessionRoutes
from app.server.static_files import static_folder


class Nobody:
    async def serve(self, socket, role, name):
        pass


@pytest.fixture
def folders(tmp_path):
    """Two sessions, and the folder of the user's state."""
    for name in ("walk", "dance"):
        shutil.copytree(SAMPLE, tmp_path / name)
    return tmp_path / "walk", tmp_path / "dance", tmp_path / "state"


class Client:
    """A page of the program."""

    def __init__(self, session, port, routes):
        self.session, self._origin, self.routes = session, f"http://127.0.0.1:{port}", routes

    async def get(self, path):
        async with self.session.get(path) as response:
            return response.status, await response.text()

    async def make(self, form):
        status, text = await self.open(form, "/sessions/new")
        assert status == 200, text
        return [json.loads(line) for line in text.splitlines()]

    async def open(self, body, path="/sessions/open", **headers):
        headers = {"Origin": self._origin, "Content-Type": "application/json"} | headers
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        async with self.session.post(path, data=data, headers=headers) as response:
            return response.status, await response.text()


@pytest.fixture
async def serve(folders, tmp_path):
    clients = []

    async def start(why=None, unsaved=None):
        app = server.create_app(Nobody(), tmp_path / "nobody", Access(token="secret"), static_folder())
        routes = SessionRoutes(folders[0], folders[2], why, lambda: unsaved)
        routes.add_to(app)
        context = listening(app)
        port = await context.__aenter__()
        session = aiohttp.ClientSession(f"http://127.0.0.1:{port}")
        session.cookie_jar.update_cookies({f"quadrille_{port}": "secret"})
        clients.append((context, session))
        return Client(session, port, routes)

    yield start
    for context, session in clients:
        await session.close()
        await context.__aexit__(None, None, None)
