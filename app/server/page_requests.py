"""Requests that only the page of the program's own user may send: where they come from, and what they hold."""

from collections.abc import Awaitable, Callable
from typing import Any

import msgspec
from aiohttp import web

from app.remedies import page_text
from app.state.role import Role
from tracker.errors import SessionError, TrackerError
from tracker.validation import check

ROLE: web.RequestKey[Role] = web.RequestKey("role")
"""The role that the token of a request gives."""


def require_page(request: web.Request, refusal: str | None) -> None:
    """Check that a request comes from the page itself.

    Args:
        request: the request.
        refusal: why no page may send such requests; None if it may.

    Raises:
        HTTPForbidden: it may not.
    """
    if refusal is not None:
        raise web.HTTPForbidden(text=refusal)
    # Without a token, an image in a foreign page could start work, though never read the result.
    if request.headers.get("Sec-Fetch-Site", "none") not in ("same-origin", "none"):
        raise web.HTTPForbidden(text="Expected a request of this page, found one of another site.")


@web.middleware
async def answer_errors(
    request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
) -> web.StreamResponse:
    """Answer with the sentence of an error that a user can mend."""
    try:
        return await handler(request)
    except TrackerError as error:
        raise web.HTTPBadRequest(text=page_text(error)) from error


async def read_body(request: web.Request, declaration: Any, refusal: str | None) -> Any:
    """Return the body of a request of the page, checked against its declaration.

    Args:
        request: the request, with JSON.
        declaration: a type that msgspec knows.
        refusal: as for `require_page`.

    Raises:
        HTTPForbidden: it is not of the page.
        HTTPBadRequest: it is no JSON.
        SessionError: it does not fit the declaration.
    """
    require_page(request, refusal)
    # A foreign page can send a form without asking, JSON it cannot. The guard has seen the Origin.
    if request.content_type != "application/json" or "Origin" not in request.headers:
        raise web.HTTPForbidden(text="Expected a request of this page, found another.")
    data = await request.read()
    try:
        decoded = msgspec.json.decode(data)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise web.HTTPBadRequest(text=f"Expected a request in JSON, found other data ({error}).") from error
    return check(decoded, declaration, "the form", SessionError)
