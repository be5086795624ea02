"""The log of a server that strangers can reach stays short."""

import asyncio
import errno
import io
import logging
import socket
from contextlib import contextmanager

import pytest
from aiohttp import web
from serving import NO_VISER

from app.runtime import log_limit
from app.server import connections, server
from app.server.access import Access
from app.server.static_files import static_folder

ODD = [
    b"\x00\x01\x02\r\n\r\n", b"FOO\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
    b"GET http://[::1 HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET / HTTP/1.1\r\nHost: localhost\r\nA: \x00\r\n\r\n",
    b"GET /" + 9000 * b"a" + b" HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET / HTTP/1.1\r\nHost: local\xe9host\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://\xe9\r\n\r\n",
    b"GET / HTTP/1.1\r\nContent-Length: x\r\nHost: localhost\r\n\r\n",
]  # fmt: skip


@contextmanager
def heard(monkeypatch):
    """What the process shows on standard error."""
    text, root = io.StringIO(), logging.getLogger()
    before = list(root.handlers)
    monkeypatch.setattr("sys.stderr", text)
    log_limit.limit_log()
    monkeypatch.undo()
    yield text
    for handler in set(root.handlers) - set(before):
        root.removeHandler(handler)


class Listening(socket.socket):
    """A listening socket that can run out of descriptors."""

    is_out = False

    def accept(self):
        if self.is_out:
            raise OSError(errno.EMFILE, "Too many open files")
        return super().accept()


@contextmanager
def listening():
    with Listening() as one:
        one.bind(("127.0.0.1", 0))
        one.listen(128)
        one.setblocking(False)
        yield one


async def asked(port, request):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    try:
        async with asyncio.timeout(20):
            return await reader.readline()
    finally:
        writer.close()


@pytest.fixture
async def port_and_socket():
    runner = connections.LimitedRunner(server.create_app(None, NO_VISER, Access(), static_folder()))
    await runner.setup()
    with listening() as one:
        await web.SockSite(runner, one).start()
        yield one.getsockname()[1], one
        await runner.cleanup()


async def test_requests_that_are_not_http_leave_a_few_sentences(port_and_socket, monkeypatch):
    port, _ = port_and_socket
    with heard(monkeypatch) as text:
        for request in 20 * ODD:
            assert (await asked(port, request)).split()[1] in (b"400", b"403", b"414")
    assert "Traceback" not in text.getvalue()
    assert 1 <= len(text.getvalue().splitlines()) <= 3 * len(ODD)


async def test_a_server_without_descriptors_says_so_and_recovers(port_and_socket, monkeypatch):
    port, one = port_and_socket
    one.is_out = True
    with heard(monkeypatch) as text:
        answer = asyncio.create_task(asked(port, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"))
        await asyncio.sleep(0.1)
        one.is_out = False
        assert b"200" in await answer
    lines = text.getvalue().splitlines()
    assert 1 <= len(lines) <= 3
    assert all("found all in use" in line for line in lines)


def test_a_kind_that_repeats_is_shown_again_later_with_what_was_left_out(monkeypatch):
    now = 0.0
    monkeypatch.setattr(log_limit.time, "monotonic", lambda: now)
    limit, shown = log_limit.LogLimit(), []
    for now in (*range(10), 61.0):
        for what in ("one", "another"):
            record = logging.LogRecord("a", logging.ERROR, "", 1, f"{what} failed", (), None)
            if limit.filter(record):
                shown.append((now, record.getMessage()))
    assert shown[:6] == [(k, f"{what} failed") for k in range(3) for what in ("one", "another")]
    assert shown[6:] == [(61.0, f"{what} failed (7 more like this were left out)") for what in ("one", "another")]


def test_faults_of_the_program_keep_their_traceback():
    try:
        raise ValueError("odd")
    except ValueError as error:
        record = logging.LogRecord("a", logging.ERROR, "", 1, "it failed", (), (ValueError, error, error.__traceback__))
    assert log_limit.LogLimit().filter(record)
    assert record.exc_info
