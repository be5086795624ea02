"""Half-open connections end after the timeout, while a page works on."""

import asyncio
import shutil
import time

import pytest
from command_line import SAMPLE
from page_visits import joined
from program import Program

from app.server.connections import HEADERS_S

pytestmark = pytest.mark.slow

_STARTS = (b"", b"GET / HT", b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ", b"GET /static/main.js HTTP/1.1\r\n")
_LATE_S = 5.0


async def test_half_open_connections_are_gone_after_the_timeout(tmp_path, cases, report):
    n, slowest = cases(500), 0.0
    program = Program(shutil.copytree(SAMPLE, tmp_path / "session"))
    await program.start()
    port = int(program.address.rstrip("/").rpartition(":")[2])
    try:
        async with joined(program.address) as page:
            await page.hear("image", timeout_s=60)
            opened = [await asyncio.open_connection("127.0.0.1", port) for _ in range(n)]
            for i, (_, writer) in enumerate(opened):
                writer.write(_STARTS[i % len(_STARTS)])
            began = time.monotonic()
            ends = asyncio.gather(*(end_of(reader) for reader, _ in opened))
            frame = 0
            while not ends.done() and time.monotonic() < began + HEADERS_S + _LATE_S:
                frame = (frame + 1) % 40
                asked = time.monotonic()
                await page.send("seek", frame=frame)
                await page.hear("image", lambda m, k=frame: m["frame"] == k)
                slowest = max(slowest, time.monotonic() - asked)
                await asyncio.sleep(0.2)
            left = sum(not reader.at_eof() for reader, _ in opened) if not ends.done() else 0
            async with joined(program.address) as second:  # another page finds a place
                await second.hear("state")
            ends.cancel()
    finally:
        await program.stop()
    report(
        f"{n} half-open connections: {left} left {time.monotonic() - began:.0f} s later, the page's socket kept, "
        f"slowest seek of the page {slowest:.2f} s"
    )
    assert left == 0


async def end_of(reader):
    """Read until the server ends the connection."""
    try:
        while await reader.read(4096):
            pass
    except ConnectionError:
        pass
