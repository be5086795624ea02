"""Odd messages of a page: each is a notice at most, and the socket stays."""

import shutil

import aiohttp
import numpy as np
import pytest
from command_line import SAMPLE
from odd_messages import odd_message
from page_visits import joined
from program import Program

pytestmark = pytest.mark.slow

_BATCH = 25
_FAULT = "a message of a page failed"


async def test_odd_messages_close_no_socket(tmp_path, cases, report, capfd):
    rng, n, notices, sent, closed = np.random.default_rng(9), cases(5000), 0, 0, []
    program = Program(shutil.copytree(SAMPLE, tmp_path / "session"))
    await program.start()
    try:
        while sent < n:
            async with joined(program.address) as page:
                try:
                    while sent < n:
                        for _ in range(min(_BATCH, n - sent)):
                            data, binary = odd_message(rng)
                            await page.send_raw(data, binary)
                            sent += 1
                        # A well-formed message is answered as ever.
                        await page.send("history", limit=1)
                        await page.hear("history", timeout_s=60)
                        await page.send("history", limit=0)
                        notices += sum(m["type"] == "notice" for m in page.told)
                        page.told.clear()
                except (AssertionError, aiohttp.ClientError, ConnectionError) as error:
                    closed.append((sent, repr(error)[:300]))
        async with joined(program.address) as page:
            await page.hear("state", timeout_s=60)
    finally:
        await program.stop()
    errors = capfd.readouterr().err
    faults = errors.count(_FAULT)
    report(f"{sent} odd messages: {notices} notices, {len(closed)} sockets closed, {faults} faults of the program")
    assert closed == [], errors[-6000:]
    assert faults == 0, errors[-4000:]
    assert notices > n / 2
