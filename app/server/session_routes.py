"""Open another session from the page (`NewSessionRoutes`: make one).

A page names folders of this machine, as the user could on the command line. So these requests are answered only where
nobody but the user can send them: the server listens on loopback under no other name, and asks for the token.

Serve the form of a new session: folders, pictures of footage, a survey, a calibration, and the session itself.

A page names paths of this machine. `SessionRoutes` says where such requests are answered.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from aiohttp import web

from app.remedies import page_text
from app.server import connections
from app.server.page_requests import ROLE, read_body, require_page
from app.session.board_form import BoardForm, calibrate_cameras
from app.session.footage_pictures import preview
from app.session.new_session import NewSessionForm, Report, SurveyForm, make_session, survey
from app.session.path_choice import TypedPath, completions, folder_contents, typed_path
from app.session.recent_sessions import TABLE_FILE, recent_batches, recent_sessions
from tracker.calibration.boards.board_description import DICTIONARIES
from tracker.errors import SessionError, TrackerError
from tracker.formats.model_toml import PRESETS
from tracker.formats.text_files import TextKind, read_json
from tracker.session.assemble import DEFAULT_MODEL

_BATCHES = 3
"""Number of batches that are listed."""
_TABLE_KIND = TextKind("table", 5_000_000, SessionError)


class _OpenRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A session to open."""

    folder: TypedPath
    frame: int = 0
    """Frame to show first."""
    person: str = ""
    """Name of the person to select; empty for the first one."""


class ChosenSession(NamedTuple):
    """A session to open next."""

    folder: Path
    frame: int
    """Frame to show first."""
    person: str
    """Name of the person to select; empty for the first one."""


class SessionRoutes:
    """Answers `/sessions`: recent sessions, completed paths, and another session to open."""

    def __init__(
        self, folder: Path, state_folder: Path, refusal: str | None, unsaved: Callable[[], str | None]
    ) -> None:
        """Serve the page of a session.

        Args:
            folder: of the open session.
            state_folder: keeps the list of recent sessions.
            refusal: why no other session can be opened; None if it can.
            unsaved: returns why edits are not saved; None if all are.
        """
        self._folder, self._state_folder = folder.resolve(), state_folder
        self._refusal, self._unsaved = refusal, unsaved
        self.chosen: ChosenSession | None = None
        """The session to open next."""
        self.is_chosen = asyncio.Event()
        """Whether the page has asked for another session."""

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/starting.json", self._started)
        app.router.add_get("/sessions", self._list)
        app.router.add_get("/sessions/paths", self._complete)
        app.router.add_post("/sessions/open", self._open)
        NewSessionRoutes(self._refusal).add_to(app)

    async def _started(self, request: web.Request) -> web.Response:
        """Answer a page that waits for the program, as `StartupServer` does before: no step is left."""
        is_told = self._refusal is None and request[ROLE] == "host"
        folder = str(self._folder) if is_told else ""
        return web.json_response({"steps": [], "at": 0, "folder": folder})

    async def _list(self, _: web.Request) -> web.Response:
        if self._refusal is not None:
            return web.json_response({"refusal": self._refusal, "folder": "", "recent": [], "batches": []})
        found = await asyncio.to_thread(recent_sessions, self._state_folder)
        batches = await asyncio.to_thread(recent_tables, self._state_folder)
        recent = [
            {"folder": str(s.folder), "name": s.folder.name, "opened": s.opened}
            for s in found
            if s.folder != self._folder
        ]
        here = {"refusal": None, "folder": str(self._folder)}
        return web.json_response({**here, "recent": recent, "batches": batches})

    async def _complete(self, request: web.Request) -> web.Response:
        require_page(request, self._refusal)
        found = await asyncio.to_thread(completions, request.query.get("text", "")[:4096])
        return web.json_response([{"path": path, "is_session": is_session} for path, is_session in found])

    async def _open(self, request: web.Request) -> web.Response:
        body = await read_body(request, _OpenRequest, self._refusal)
        if self.is_chosen.is_set():
            raise web.HTTPConflict(text="Another session is being opened; wait for it.")
        folder = await asyncio.to_thread(self._checked, body)
        self.chosen = ChosenSession(folder, body.frame, body.person)
        self.is_chosen.set()
        return web.json_response({"name": folder.name})

    def _checked(self, body: _OpenRequest) -> Path:
        """Return the folder of a session that can be opened in place of the present one.

        Raises:
            TrackerError: it is none, files are missing, it is open elsewhere, or edits of the present one are unsaved.
        """
        from tracker.session.lock import SessionLock
        from tracker.session.relink import require_files
        from tracker.session.session import load_session

        folder = typed_path(body.folder).resolve()
        if folder == self._folder:
            raise SessionError(f"expected another session, found the one that is open, {folder}; choose another folder")
        session = load_session(folder)
        if not 0 <= body.frame < session.n_frames:
            raise SessionError(f"expected a frame from 0 to {session.n_frames - 1}, found {body.frame}; open its start")
        if body.person and body.person not in [p.name for p in session.people]:
            raise SessionError(f"expected a person of the session, found '{body.person}'; open it without one")
        require_files(session)
        with SessionLock(session.folder):
            pass  # not open in another program
        if why := self._unsaved():
            raise SessionError(f"expected all edits to be saved, found some that are not: {why}; retry saving first")
        return folder


def recent_tables(state_folder: Path) -> list[dict[str, Any]]:
    """Return the tables of the last batches, as `quadrille batch --json` prints them; unreadable ones are left out."""
    tables = []
    for folder in recent_batches(state_folder)[:_BATCHES]:
        with suppress(TrackerError, OSError, KeyError, TypeError):
            found = read_json(folder / TABLE_FILE, _TABLE_KIND)
            tables.append({"name": folder.name, "totals": found["totals"], "recordings": found["recordings"]})
    return tables


def refusal(host_is_private: bool, has_token: bool) -> str | None:
    """Return why the page of a server may not name files of this machine; None if it may.

    Args:
        host_is_private: whether the server listens on loopback and under no other name.
        has_token: whether requests need a token.
    """
    if host_is_private and has_token:
        return None
    found = "one without a token" if host_is_private else "one that other machines can reach"
    return (
        f"expected a page that only its user can open, found {found}; name files on the command line, to "
        "'quadrille SESSION' or 'quadrille import'"
    )


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
