"""Serve the form of a new session: folders, pictures of footage, a survey, a calibration, and the session itself.

A page names paths of this machine. `SessionRoutes` says where such requests are answered.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any

import msgspec
from aiohttp import web

from app.remedies import page_text
from app.server import connections
from app.server.page_requests import read_body, require_page
from app.session.board_form import BoardForm, calibrate_cameras
from app.session.footage_preview import preview
from app.session.new_session import NewSessionForm, Report, make_session
from app.session.path_choice import folder_contents, typed_path
from app.session.survey import SurveyForm, survey
from tracker.calibration.boards.board_description import DICTIONARIES
from tracker.errors import TrackerError
from tracker.formats.model_toml import PRESETS
from tracker.session.assemble import DEFAULT_MODEL

_MAX_WAITING = 64
"""Number of pictures that may wait: those of the cameras of a large studio."""
_MAX_PATH = 4096


class NewSessionRoutes:
    """Answers what the form of a new session asks for, below `/sessions`."""

    def __init__(self, refusal: str | None) -> None:
        """Serve the form.

        Args:
            refusal: why no session can be made; None if one can.
        """
        self._refusal = refusal
        self._making, self._calibrating = asyncio.Lock(), asyncio.Lock()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="previews")
        self._n_waiting = 0

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/sessions/models", self._models)
        app.router.add_get("/sessions/folder", self._list)
        app.router.add_get("/sessions/preview", self._preview)
        app.router.add_post("/sessions/survey", self._survey)
        app.router.add_post("/sessions/new", self._make)
        app.router.add_post("/sessions/calibrate", self._calibrate)
        app.on_cleanup.append(self._close)

    async def _close(self, _: web.Application) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    async def _models(self, request: web.Request) -> web.Response:
        require_page(request, self._refusal)
        return web.json_response({"models": PRESETS, "default": DEFAULT_MODEL, "dictionaries": DICTIONARIES})

    async def _list(self, request: web.Request) -> web.Response:
        require_page(request, self._refusal)
        found = await asyncio.to_thread(folder_contents, request.query.get("path", "")[:_MAX_PATH])
        entries = [entry._asdict() for entry in found.entries]
        return web.json_response(found._asdict() | {"entries": entries})

    async def _preview(self, request: web.Request) -> web.Response:
        require_page(request, self._refusal)
        if self._n_waiting >= _MAX_WAITING:
            raise web.HTTPServiceUnavailable(text="Too many pictures are being made; try again later.")
        self._n_waiting += 1
        try:
            path = typed_path(request.query.get("path", "")[:_MAX_PATH])
            made = await asyncio.get_running_loop().run_in_executor(self._pool, preview, path)
        except TrackerError as error:  # no footage lies there: the form draws a frame without a picture
            raise web.HTTPNotFound(text=page_text(error)) from error
        finally:
            self._n_waiting -= 1
        return web.Response(body=made, content_type="image/jpeg")

    async def _survey(self, request: web.Request) -> web.Response:
        found = await asyncio.to_thread(survey, await read_body(request, SurveyForm, self._refusal))
        return web.Response(body=msgspec.json.encode(found), content_type="application/json")

    async def _make(self, request: web.Request) -> web.StreamResponse:
        form = await read_body(request, NewSessionForm, self._refusal)
        return await _work_in_lines(request, self._making, "session is being made", partial(make_session, form))

    async def _calibrate(self, request: web.Request) -> web.StreamResponse:
        form = await read_body(request, BoardForm, self._refusal)
        work = partial(calibrate_cameras, form)
        return await _work_in_lines(request, self._calibrating, "calibration is being made", work)


async def _work_in_lines(
    request: web.Request, lock: asyncio.Lock, rival: str, work: Callable[[Report], None]
) -> web.StreamResponse:
    """Do work in a thread. The answer has one JSON object per line: each step, then the outcome.

    Args:
        request: the request; the work ends at its next step once the page that sent it is gone.
        lock: held meanwhile.
        rival: work that holds it, in words.
        work: given a function that takes each line.

    Raises:
        HTTPConflict: the lock is held.
    """
    if lock.locked():
        raise web.HTTPConflict(text=f"Another {rival}, or is about to stop; wait for it.")
    async with lock:
        connections.keep_open(request)
        response = web.StreamResponse(headers={"Content-Type": "application/x-ndjson"})
        await response.prepare(request)
        lines: asyncio.Queue[dict[str, Any] | None] = asyncio.Queue()
        loop = asyncio.get_running_loop()

        def report(kind: str, what: Any) -> None:
            if request.transport is None:
                raise ConnectionResetError
            loop.call_soon_threadsafe(lines.put_nowait, {kind: what})

        task = asyncio.ensure_future(asyncio.to_thread(work, report))
        task.add_done_callback(lambda _: lines.put_nowait(None))
        with suppress(ConnectionResetError):
            while (line := await lines.get()) is not None:
                await response.write(msgspec.json.encode(line) + b"\n")
            await response.write_eof()
        with suppress(ConnectionResetError):
            await task
        return response
