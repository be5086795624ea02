"""Serve an aiohttp application for the length of a test."""

from contextlib import asynccontextmanager

from aiohttp import web


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
