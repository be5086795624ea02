"""Open another copy of the session, which the page names by its path, to compare with it.

A page names paths of this machine: `SessionRoutes` says where such requests are answered.
"""

import asyncio

import msgspec
from aiohttp import web

from app.control.controller import Controller
from app.server.page_requests import read_body
from app.session.path_choice import TypedPath, typed_path


class _CopyRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A copy to compare with."""

    folder: TypedPath


class CopyRoutes:
    """Answers `/copies/open`."""

    def __init__(self, controller: Controller, refusal: str | None) -> None:
        """Serve the section of the inspector.

        Args:
            controller: of the open session.
            refusal: why no path can be named; None if one can.
        """
        self._controller, self._refusal = controller, refusal
        self._busy = asyncio.Lock()

    def add_to(self, app: web.Application) -> None:
        """Add the route to an application."""
        app.router.add_post("/copies/open", self._open)

    async def _open(self, request: web.Request) -> web.Response:
        body = await read_body(request, _CopyRequest, self._refusal)
        async with self._busy:
            folder = await asyncio.to_thread(lambda: typed_path(body.folder).resolve())
            await asyncio.to_thread(self._controller.other_copies.open, folder)
        return web.json_response({"opened": True})
