"""Connections are limited in number and in age; pages are not."""

import asyncio
from contextlib import closing

import aiohttp
import pytest
from serving import NO_VISER, running

from app.server import connections, server
from app.server.access import Access
from app.server.static_files import static_folder


class EchoPanes:
    async def serve(self, socket, role, name=""):
        async for message in socket:
            await socket.send_bytes(message.data)


@pytest.fixture(autouse=True)
def short_times(monkeypatch):
    monkeypatch.setattr(connections, "HEADERS_S", 0.3)
    monkeypatch.setattr(connections, "KEEPALIVE_S", 0.3)
    monkeypatch.setattr(connections, "LINGER_S", 0.2)


def serving():
    app = server.create_app(EchoPanes(), NO_VISER, Access(), static_folder())
    return running(connections.LimitedRunner(app))


async def end_of(reader):
    """What comes until the server ends the connection."""
    async with asyncio.timeout(5):
        try:
            return await reader.read()
        except ConnectionResetError:
            return b""


@pytest.mark.parametrize(
    "start",
    [b"", b"GET / HT", b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ",
     b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99\r\n\r\nabc",
     b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET /static"],
)  # fmt: skip
async def test_half_open_connections_end(start):
    async with serving() as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(start)
        await end_of(reader)
        writer.close()


async def test_headers_that_drip_end():
    async with serving() as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")

        async def drip():
            while True:
                writer.write(b"x")
                await asyncio.sleep(0.02)

        task = asyncio.create_task(drip())
        await end_of(reader)
        task.cancel()
        writer.close()


@pytest.mark.slow
async def test_a_reader_that_stands_still_ends(monkeypatch):
    """Idle connections are kept here: only the limit of an answer can end this one."""
    monkeypatch.setattr(connections, "ANSWER_S", 0.3)
    monkeypatch.setattr(connections, "KEEPALIVE_S", 60.0)
    async with serving() as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1024)
        writer.write(b"GET /static/main.js HTTP/1.1\r\nHost: localhost\r\n\r\n" * 2000)
        await asyncio.sleep(0.8)
        await end_of(reader)
        writer.close()


@pytest.mark.slow
async def test_a_page_stays_though_it_is_silent(monkeypatch):
    monkeypatch.setattr(connections, "ANSWER_S", 0.2)
    async with (
        serving() as port,
        aiohttp.ClientSession() as session,
        session.ws_connect(f"http://127.0.0.1:{port}/ws") as socket,
    ):
        await asyncio.sleep(1.0)
        await socket.send_str("still here")
        assert (await socket.receive(timeout=5)).data == b"still here"


async def test_too_many_connections_are_refused_with_a_reason(monkeypatch):
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", 3)
    async with serving() as port, aiohttp.ClientSession() as session:
        address = f"http://127.0.0.1:{port}/"
        sockets = [await session.ws_connect(address + "ws") for _ in range(3)]
        async with session.get(address) as response:
            assert response.status == 503
            assert "close other pages" in await response.text()
        await sockets[0].close()
        async with session.get(address) as response:
            assert response.status == 200
        await sockets[1].send_str("still here")
        assert (await sockets[1].receive(timeout=5)).data == b"still here"


async def test_a_page_has_precedence_over_connections_that_ask_nothing(monkeypatch):
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", 5)
    monkeypatch.setattr(connections, "HEADERS_S", 60.0)
    async with serving() as port, aiohttp.ClientSession() as session:
        idle = [await asyncio.open_connection("127.0.0.1", port) for _ in range(5)]
        async with session.ws_connect(f"http://127.0.0.1:{port}/ws") as socket:
            await socket.send_str("served")
            assert (await socket.receive(timeout=5)).data == b"served"
        await end_of(idle[0][0])
        for _, writer in idle:
            with closing(writer):
                pass


async def test_a_refused_request_keeps_no_connection():
    async with serving() as port:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n")
        answer = await end_of(reader)
        assert b"403" in answer
        assert b"Connection: close" in answer
        writer.close()
