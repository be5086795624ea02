"""Open another session from the page, or make one of videos and a calibration.

A page names folders of this machine, as the user could on the command line. So these requests are answered only where
nobody but the user can send them: the server listens on loopback under no other name, and asks for the token.
"""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import msgspec
from aiohttp import web
from msgspec import Meta

from app.remedies import page_text
from app.server import connections
from app.session.camera_check import exchange_note
from app.session.new_session import NewSessionForm, make_session
from app.session.path_choice import completions, typed_path
from app.session.recent_sessions import recent_sessions
from tracker.errors import SessionError, TrackerError
from tracker.validation import check

_Path = Annotated[str, Meta(min_length=1, max_length=4096, description="a path")]


class _OpenRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A session to open."""

    folder: _Path


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
        self._making = asyncio.Lock()
        self.chosen: Path | None = None
        """The session to open next."""
        self.is_chosen = asyncio.Event()
        """Whether the page has asked for another session."""

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/starting.json", self._started)
        app.router.add_get("/sessions", self._list)
        app.router.add_get("/sessions/paths", self._complete)
        app.router.add_post("/sessions/open", self._open)
        app.router.add_post("/sessions/new", self._make)

    async def _started(self, _: web.Request) -> web.Response:
        """Answer a page that waits for the program, as `Doorway` does before: no step is left."""
        folder = "" if self._refusal is not None else str(self._folder)
        return web.json_response({"steps": [], "at": 0, "folder": folder})

    async def _list(self, _: web.Request) -> web.Response:
        if self._refusal is not None:
            return web.json_response({"refusal": self._refusal, "folder": "", "recent": []})
        found = await asyncio.to_thread(recent_sessions, self._state_folder)
        recent = [
            {"folder": str(s.folder), "name": s.folder.name, "opened": s.opened}
            for s in found
            if s.folder != self._folder
        ]
        return web.json_response({"refusal": None, "folder": str(self._folder), "recent": recent})

    async def _complete(self, request: web.Request) -> web.Response:
        self._check(request)
        found = await asyncio.to_thread(completions, request.query.get("text", "")[:4096])
        return web.json_response([{"path": path, "is_session": is_session} for path, is_session in found])

    async def _open(self, request: web.Request) -> web.Response:
        body = await self._body(request, _OpenRequest)
        if self.is_chosen.is_set():
            raise web.HTTPConflict(text="Another session is being opened; wait for it.")
        try:
            folder = await asyncio.to_thread(self._checked, body.folder)
        except TrackerError as error:
            raise web.HTTPBadRequest(text=page_text(error)) from error
        self.chosen = folder
        self.is_chosen.set()
        return web.json_response({"name": folder.name})

    async def _make(self, request: web.Request) -> web.StreamResponse:
        """Make a session. The answer has one JSON object per line: each check that has passed, then the outcome."""
        form = await self._body(request, NewSessionForm)
        if self._making.locked():
            raise web.HTTPConflict(text="Another session is being made; wait for it.")
        async with self._making:
            connections.keep_open(request)
            response = web.StreamResponse(headers={"Content-Type": "application/x-ndjson"})
            await response.prepare(request)
            lines: asyncio.Queue[dict[str, str] | None] = asyncio.Queue()
            loop = asyncio.get_running_loop()

            def report(kind: str, text: str) -> None:
                loop.call_soon_threadsafe(lines.put_nowait, {kind: text})

            work = asyncio.ensure_future(asyncio.to_thread(_made, form, report))
            work.add_done_callback(lambda _: lines.put_nowait(None))
            while (line := await lines.get()) is not None:
                await response.write(msgspec.json.encode(line) + b"\n")
            await work
            await response.write_eof()
            return response

    def _checked(self, text: str) -> Path:
        """Return the folder of a session that can be opened in place of the present one.

        Raises:
            TrackerError: it is none, files are missing, it is open elsewhere, or edits of the present one are unsaved.
        """
        from tracker.session.lock import SessionLock
        from tracker.session.relink import require_files
        from tracker.session.session import load_session

        folder = typed_path(text).resolve()
        if folder == self._folder:
            raise SessionError(f"expected another session, found the one that is open, {folder}; choose another folder")
        session = load_session(folder)
        require_files(session)
        with SessionLock(session.folder):
            pass  # not open in another program
        if why := self._unsaved():
            raise SessionError(f"expected all edits to be saved, found some that are not: {why}; retry saving first")
        return folder

    def _check(self, request: web.Request) -> None:
        if self._refusal is not None:
            raise web.HTTPForbidden(text=self._refusal)
        if request.headers.get("Sec-Fetch-Site", "same-origin") != "same-origin":
            raise web.HTTPForbidden(text="Expected a request of this page, found one of another site.")

    async def _body(self, request: web.Request, declaration: Any) -> Any:
        """Return the body of a request of the page, checked against its declaration."""
        self._check(request)
        # A foreign page can send a form without asking, JSON it cannot. The guard has seen the Origin.
        if request.content_type != "application/json" or "Origin" not in request.headers:
            raise web.HTTPForbidden(text="Expected a request of this page, found another.")
        data = await request.read()
        try:
            return check(msgspec.json.decode(data), declaration, "request", SessionError)
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            raise web.HTTPBadRequest(text=f"Expected a request in JSON, found other data ({error}).") from error
        except SessionError as error:
            raise web.HTTPBadRequest(text=page_text(error)) from error


def _made(form: NewSessionForm, report: Callable[[str, str], None]) -> None:
    """Make a session, and report the checks that pass, what went wrong or seems wrong, and its folder."""
    try:
        session = make_session(form, lambda text: report("passed", text))
    except TrackerError as error:
        report("failed", page_text(error))
        return
    if note := exchange_note(session):
        report("warning", note)
    else:
        report("passed", "No two cameras seem to be exchanged.")
    report("made", str(session.folder))


def refusal(host_is_private: bool, has_token: bool) -> str | None:
    """Return why the page of a server may not choose sessions; None if it may.

    Args:
        host_is_private: whether the server listens on loopback and under no other name.
        has_token: whether requests need a token.
    """
    if host_is_private and has_token:
        return None
    found = "one without a token" if host_is_private else "one that other machines can reach"
    return (
        f"expected a page that only its user can open, found {found}; open other sessions on the command line, "
        "with 'quadrille SESSION'"
    )
