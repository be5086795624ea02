"""Read and change the keys that the user has given to commands of the page."""

import asyncio
from pathlib import Path
from typing import Annotated, Any

import msgspec
import tomli_w
from aiohttp import web
from msgspec import Meta

from app.remedies import page_text
from app.server.page_requests import read_body, require_page
from tracker.errors import SessionError
from tracker.files import write_text_atomic
from tracker.formats.text_files import TextKind, read_toml

KEYS_FILE = "keys.toml"
"""Name of the file in the user's state folder: the keys of a command by its label, `"Track forward" = ["T"]`."""
_KIND = TextKind("file of keys", 200_000, SessionError)
_Text = Annotated[str, Meta(max_length=200)]
_Changes = Annotated[dict[_Text, Annotated[list[_Text], Meta(max_length=10)] | None], Meta(max_length=1000)]


class KeyRoutes:
    """Answers `/keys`. The page checks labels and keys, because it declares the commands."""

    def __init__(self, state_folder: Path, has_token: bool) -> None:
        """Serve the keys kept in a folder, which is private to the user and made where it is missing.

        Args:
            state_folder: of the user.
            has_token: whether requests need a token; without one every account of this machine could change keys.
        """
        self._path = state_folder / KEYS_FILE
        found = f"expected a page that only its user can open, found one without a token; write keys to {self._path}"
        self._refusal = None if has_token else found

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/keys", self._get)
        app.router.add_post("/keys", self._change)

    async def _get(self, request: web.Request) -> web.Response:
        require_page(request, None)
        answer = {"file": str(self._path), "keys": await asyncio.to_thread(self._read)}
        return web.Response(body=msgspec.json.encode(answer), content_type="application/json")

    async def _change(self, request: web.Request) -> web.Response:
        changes = await read_body(request, _Changes, self._refusal)
        try:
            await asyncio.to_thread(self._write, changes)
        except (OSError, UnicodeError) as error:
            raise web.HTTPBadRequest(text=page_text(error)) from error
        return web.json_response({"changed": True})

    def _read(self) -> dict[str, Any]:
        return read_toml(self._path, _KIND) if self._path.exists() else {}

    def _write(self, changes: dict[str, list[str] | None]) -> None:
        """Replace lines; null removes one. Other lines stay, also those that the page cannot read."""
        keys = {label: own for label, own in (self._read() | changes).items() if own is not None}
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_text_atomic(self._path, tomli_w.dumps(keys), mode=0o600)
