"""Visits to the pane socket of a controller, as a page makes them."""

import asyncio
import json
import struct
from contextlib import asynccontextmanager
from urllib.parse import quote

import aiohttp
from aiohttp import web
from declared_messages import checked
from serving import listening

from app.page.socket import PaneSocket
from app.participants.participants import Participants


class Page:
    """A page that keeps every message, and checks it against its declaration."""

    def __init__(self, socket):
        self._socket = socket
        self.told = []

    async def send(self, kind, **fields):
        await self._socket.send_str(json.dumps({"type": kind, **fields}))

    async def send_raw(self, data, binary=False):
        """Send bytes as they are, as a text message or a binary one."""
        await self._socket.send_frame(data, aiohttp.WSMsgType.BINARY if binary else aiohttp.WSMsgType.TEXT)

    async def shows(self, *layers, reductions=(1, 1, 1, 1), by_part=False):
        """Say what the page shows."""
        await self.send("view", layers=layers, reductions=reductions, by_part=by_part)

    async def seek(self, frame):
        """Go to a frame, and wait until the state shows it."""
        await self.send("seek", frame=frame)
        return await self.hear("state", lambda m: m["frame"] == frame)

    async def hear(self, kind, condition=lambda _: True, timeout_s=60.0):
        """The next message of a kind for which a condition holds; binary ones with their `payload`."""
        async with asyncio.timeout(timeout_s):
            while True:
                message = self._read(await self._socket.receive())
                self.told.append(message)
                if message["type"] == kind and condition(message):
                    return message

    def _read(self, message):
        if message.type is aiohttp.WSMsgType.TEXT:
            return checked(message.data)
        assert message.type is aiohttp.WSMsgType.BINARY, message
        (length,) = struct.unpack_from("<I", message.data)
        return checked(message.data[4 : 4 + length]) | {"payload": message.data[4 + length :]}


@asynccontextmanager
async def visiting(controller, notices=(), role="host", name="", participants=None, panes=None):
    people = participants or Participants(controller)
    panes = panes or PaneSocket(people, notices)

    async def serve(request):
        socket = web.WebSocketResponse(decode_text=False)
        await socket.prepare(request)
        await panes.serve(socket, role, name)
        return socket

    app = web.Application()
    app.router.add_get("/ws", serve)
    try:
        async with (
            listening(app) as port,
            aiohttp.ClientSession() as session,
            session.ws_connect(f"http://127.0.0.1:{port}/ws") as socket,
        ):
            page = Page(socket)
            await page.shows("image", "contours", "joints")
            yield page
    finally:
        if participants is None:
            people.close()


@asynccontextmanager
async def joined(address, name=""):
    """A page of a running program, by its address."""
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{address}ws?name={quote(name)}", max_msg_size=0) as socket,
    ):
        page = Page(socket)
        await page.shows("image", "contours", "joints")
        yield page
