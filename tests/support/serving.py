"""Serve an aiohttp application for the length of a test."""

import json
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp
from aiohttp import web

from app.server import server
from app.server.access import Access
from app.server.private_viser import ViserPlace
from app.server.static_files import static_folder


async def answer(client, path, **headers):
    """Return status and text of an answer; bytes that are no text are replaced."""
    async with client.get(path, headers=headers) as response:
        return response.status, await response.text(errors="replace")


NO_VISER = ViserPlace(Path("/nowhere/viser"), 0, "")
"""A place at which nothing listens."""


class Nobody:
    """Serves no panes."""

    async def serve(self, socket, role, name=""):
        pass


class Page:
    """A page of the program, which has its cookie."""

    def __init__(self, session, origin):
        self.session, self.origin = session, origin

    async def get(self, path, **headers):
        """See `answer`."""
        return await answer(self.session, path, **headers)

    async def post(self, path, body, **headers):
        """Post JSON, or bytes as they are; return status and text of the answer."""
        headers = {"Origin": self.origin, "Content-Type": "application/json"} | headers
        data = body if isinstance(body, bytes) else json.dumps(body).encode()
        async with self.session.post(path, data=data, headers=headers) as response:
            return response.status, await response.text()


@asynccontextmanager
async def page_of(*routes, kind=Page):
    """Serve the program with some routes alone; gives its page."""
    app = server.create_app(Nobody(), NO_VISER, Access(token="secret"), static_folder())
    for own in routes:
        own.add_to(app)
    async with listening(app) as port, aiohttp.ClientSession(f"http://127.0.0.1:{port}") as session:
        session.cookie_jar.update_cookies({f"quadrille_{port}": "secret"})
        yield kind(session, f"http://127.0.0.1:{port}")


@asynccontextmanager
async def listening(app, port=0):
    """Serve on loopback; gives the port. Ends at once, as when the program is killed."""
    async with running(web.AppRunner(app, shutdown_timeout=0.1), port) as taken:
        yield taken


@asynccontextmanager
async def running(runner, port=0):
    """Serve by a given runner on loopback; gives the port."""
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", port, reuse_address=True).start()
    try:
        yield runner.addresses[0][1]
    finally:
        await runner.cleanup()
