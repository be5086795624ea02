"""The web server: the page, its pane socket, and viser behind `/viser/`.

One port serves everything, so one SSH tunnel is enough. Every request passes `access` first. viser itself has no such
check, and listens on a private socket (`private_viser`).
"""

import asyncio
import logging
import os
import socket
import weakref
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path
from typing import Protocol

import aiohttp
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from app.server import connections, private_viser
from app.server.access import NO_TOKEN, Access, root_of
from app.server.page_requests import ROLE, answer_errors
from app.server.private_viser import ViserPlace
from app.server.static_files import KEPT, POLICY, PREFIX, ROUTE, PageFiles, connect_sources
from app.state.role import Role

_LOG = logging.getLogger(__name__)
_SOCKETS: web.AppKey[weakref.WeakSet[web.WebSocketResponse]] = web.AppKey("sockets", weakref.WeakSet)
_ROOTS: web.AppKey[Sequence[str]] = web.AppKey("roots", tuple)
_ENTRY = (
    '<!doctype html><title>Quadrille</title><link rel="icon" href="data:,">'
    '<meta http-equiv="refresh" content="0; url={root}">'
)
"""Answer to an address with a token: the browser goes on to the page's own address, and does not keep this one."""
_SHOWN, _SHOWN_BELOW = ("/", "/ws", "/starting.json"), (f"/{PREFIX}", "/thumbnail/")
"""Paths that a shared link may ask for, and beginnings of such paths; 3-D view, exports and other sessions are none."""
_MAX_MESSAGE_BYTES = 1 << 20  # what a page sends is a line or two of JSON
_MAX_PATH_CHARACTERS = 2000
_MAX_NAME_BYTES = 255
_HEARTBEAT_S = 20.0
_CLOSE_TIMEOUT_S = 1.0


class PaneEndpoint(Protocol):
    """Answers the pane socket (docs/protocol.md)."""

    async def serve(self, socket: web.WebSocketResponse, role: Role, name: str) -> None:
        """Serve one page until its socket closes; it joins by a name, which may be empty."""


def create_app(panes: PaneEndpoint, viser: ViserPlace, access: Access, static: Path) -> web.Application:
    """Build the web application.

    Args:
        panes: answers the pane sockets, one call per page.
        viser: where it is reached.
        access: the check of every request.
        static: the folder of the page (`static_files.static_folder`).
    """
    app = web.Application(middlewares=[_guard(access), answer_errors])
    app[_SOCKETS] = weakref.WeakSet()
    app[_ROOTS] = access.roots
    proxy, files = private_viser.ViserProxy(viser), PageFiles(static)

    async def page(request: web.Request) -> web.StreamResponse:
        if access.token is None or "token" not in request.query:
            return web.Response(text=files.index(), content_type="text/html")
        # No redirect: after one, a browser that followed a link would not send a Strict cookie.
        token = access.token_of(request[ROLE])
        assert token is not None
        root, name = root_of(token), access.cookie(request.headers["Host"])
        response = web.Response(text=_ENTRY.format(root=root), content_type="text/html")
        response.headers["Content-Location"] = root
        response.set_cookie(name, token, httponly=True, samesite="Strict", path=root)
        return response

    async def page_file(request: web.Request) -> web.StreamResponse:
        found = files.find(request.path)
        if found is None:
            raise web.HTTPNotFound
        content, kind = found
        return web.Response(body=content, content_type=kind, charset="utf-8", headers={"Cache-Control": KEPT})

    async def pane_socket(request: web.Request) -> web.StreamResponse:
        # Compression gains nothing on JPEG, and is not worth the delay for small vectors. Text is decoded where it is
        # parsed: text that is not UTF-8 would close the socket.
        socket = web.WebSocketResponse(
            heartbeat=_HEARTBEAT_S,
            timeout=_CLOSE_TIMEOUT_S,
            compress=False,
            max_msg_size=_MAX_MESSAGE_BYTES,
            decode_text=False,
        )
        await socket.prepare(request)
        request.app[_SOCKETS].add(socket)
        try:
            await panes.serve(socket, request[ROLE], request.query.get("name", ""))
        except ConnectionError:
            _LOG.debug("a page closed its socket during a message")
        except Exception:
            _LOG.exception("a pane socket failed; the page connects again")
            await socket.close(code=aiohttp.WSCloseCode.INTERNAL_ERROR)
        return socket

    app.router.add_get("/", page)
    app.router.add_get("/ws", pane_socket)
    app.router.add_get(ROUTE, page_file)
    app.router.add_static(f"/{PREFIX}", static)
    app.router.add_get("/viser", proxy.handle)
    app.router.add_get("/viser/{path:.*}", proxy.handle)
    app.on_response_prepare.append(_add_headers)
    app.on_response_prepare.append(connections.keep_sockets)
    app.on_shutdown.append(_close_sockets)

    async def client(_: web.Application) -> AsyncIterator[None]:
        async with proxy:
            yield

    app.cleanup_ctx.append(client)
    return app


async def serve_forever(app: web.Application, sockets: Sequence[socket.socket], on_ready: Callable[[], None]) -> None:
    """Serve until the task is cancelled, then close all sockets.

    Args:
        app: from `create_app`.
        sockets: that listen (`address.listen`).
        on_ready: called once when the server answers.
    """
    runner = connections.LimitedRunner(app, app[_ROOTS])
    await runner.setup()
    try:
        for each in sockets:
            each.setblocking(False)
            await web.SockSite(runner, each).start()
        on_ready()
        await asyncio.Event().wait()
    finally:
        await runner.cleanup()


def _guard(access: Access) -> Middleware:
    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        connections.request_arrived(request)
        hosts = request.headers.getall("Host", [])
        cookie = request.cookies.get(access.cookie(hosts[0])) if hosts else None
        # The cookie first: a page that is loaded again must not use up its invitation twice.
        tokens = [] if access.token is None else [cookie, request.query.get("token")]
        why = access.refusal(hosts[0] if len(hosts) == 1 else None, request.headers.get("Origin"))
        role = None if why is not None else access.role(token for token in tokens if token is not None)
        if role is None:
            why = why or NO_TOKEN
        elif not _may_ask(role, request):
            why = f"expected a page of the host, found one with a link to {role}; ask the host"
        if why is not None:
            return _refused(403, f"Quadrille refused this request: {why}.\n")
        assert role is not None
        request[ROLE] = role
        if len(request.raw_path) > _MAX_PATH_CHARACTERS:
            return _refused(414, f"Expected an address of at most {_MAX_PATH_CHARACTERS} characters.\n")
        if max(map(len, os.fsencode(request.path).split(b"/"))) > _MAX_NAME_BYTES:
            raise web.HTTPNotFound  # no file system has such names: looking for one would be an error
        return await handler(request)

    return guard


def _may_ask(role: Role, request: web.Request) -> bool:
    """Return whether a role may send a request: with a shared link, only those that show the session."""
    if role == "host":
        return True
    path = request.path
    return request.method in ("GET", "HEAD") and (path in _SHOWN or path.startswith(_SHOWN_BELOW))


def _refused(status: int, text: str) -> web.Response:
    """Answer a request that nothing may follow."""
    response = web.Response(status=status, text=text)
    response.force_close()
    return response


async def _add_headers(request: web.Request, response: web.StreamResponse) -> None:
    host = request.headers.get("Host", "")
    # The guard has seen the Host header by now: it is a plain name, or the answer is a refusal, which connects nowhere.
    sources = connect_sources(host) if response.status != 403 else "'none'"
    policy = private_viser.POLICY if private_viser.is_viser(request.path) else POLICY
    response.headers["Content-Security-Policy"] = policy.format(sources=sources)
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Referrer-Policy"] = "no-referrer"
    response.headers["Cross-Origin-Resource-Policy"] = "same-origin"
    # All but the files of a version may be kept but are asked for each time (304 where nothing changed).
    response.headers.setdefault("Cache-Control", "no-cache")


async def _close_sockets(app: web.Application) -> None:
    sockets = app[_SOCKETS]
    ends = (s.close(code=aiohttp.WSCloseCode.GOING_AWAY, message=b"the program ends") for s in list(sockets))
    await asyncio.gather(*ends, return_exceptions=True)
