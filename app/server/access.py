"""Check which requests the page's server answers.

A browser lets any page on the internet send requests to this machine, so listening on loopback alone protects nothing.
Every request must name the server by an expected name (against DNS rebinding). If it has an Origin, that must have the
same name and port. Every account of this machine reaches loopback, so a request must also have the token.

Keep the token of this user's starts, so that open tabs connect again after a restart.
"""

import hashlib
import ipaddress
import logging
import os
import re
import secrets
import stat
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from app.state.role import Role
from tracker import system
from tracker.errors import TrackerError
from tracker.files import write_text_atomic

_LOG = logging.getLogger(__name__)
_HOST = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9_.-]+)(?::(?P<port>[0-9]{1,5}))?")
_DEFAULT_PORTS = {"http": "80", "https": "443"}


class SharedLink(NamedTuple):
    """A link for other people."""

    role: Role
    token: str


@dataclass(frozen=True)
class Access:
    """Requirements on a request that is answered."""

    hosts: frozenset[str] = frozenset()
    """Names of the server besides those of loopback; lower case, without port."""
    token: str | None = None
    """Token required in the page's address or its cookie; None for no such requirement."""
    invitation: "Invitation | None" = None
    """Stands for the token once, in the address that a browser is started with."""

    links: tuple[SharedLink, ...] = ()
    """Links that admit to less than everything; none without a token."""

    @property
    def roots(self) -> tuple[str, ...]:
        """Paths below which the page is served, one per token."""
        return (self.root, *(root_of(link.token) for link in self.links))

    def token_of(self, role: Role) -> str | None:
        """Return the token that gives a role."""
        return self.token if role == "host" else next(link.token for link in self.links if link.role == role)

    @property
    def root(self) -> str:
        """Path below which the page is served to those who have the token; "/" without a token.

        A browser sends cookies to every port of a machine, also to the server of another account. It sends the token's
        cookie only below this path, which nobody can guess and which does not admit by itself.
        """
        return "/" if self.token is None else root_of(self.token)

    def cookie(self, host: str) -> str:
        """Return the name of the token's cookie for a Host header.

        It has the port, so that programs on several ports do not replace one another's. A later start replaces it.
        """
        called = _HOST.fullmatch(host)
        return f"quadrille_{(called and called['port']) or _DEFAULT_PORTS['http']}"

    def refusal(self, host: str | None, origin: str | None) -> str | None:
        """Return why a request is refused whatever its token, or None.

        Args:
            host: the Host header.
            origin: the Origin header, which browsers send with every WebSocket and every request of a foreign page.
        """
        called = _HOST.fullmatch(host or "")
        if called is None or not (is_loopback(called["name"]) or called["name"].lower() in self.hosts):
            return (
                f"expected to be called by a name of this machine, found Host '{_shown(host or '')}'; "
                "open the address printed at the start, or allow this name when the program is started"
            )
        if origin is not None and not _same(origin, called):
            return f"expected a request of this page, found one of '{_shown(origin)}'; open the page itself"
        return None

    def role(self, tokens: Iterable[str] = ()) -> Role | None:
        """Return the role that the first known token gives; None if a token is required and none is known.

        Args:
            tokens: those in the request's address and cookie.
        """
        if self.token is None:
            return "host"
        for token in tokens:
            shared = [link.role for link in self.links if _equal(link.token, token)]
            if shared or self._admits(token):
                return shared[0] if shared else "host"
        return None

    def _admits(self, token: str) -> bool:
        assert self.token is not None
        return _equal(self.token, token) or (self.invitation is not None and self.invitation.redeem(token))


NO_TOKEN = (
    "expected the token of this start, found none or another; open the address that quadrille open "
    "printed on its terminal, with everything after the question mark"
)
"""Why a request without a known token is refused."""


def root_of(token: str) -> str:
    """Return the path below which the page is served to those who have a token."""
    return f"/{hashlib.sha256(f'root {token}'.encode()).hexdigest()[:32]}/"


class Invitation:
    """A code that admits one request.

    Other accounts see the command line of a browser, and with it the address that it is started with.
    """

    def __init__(self) -> None:
        """Make a code."""
        self.code = secrets.token_urlsafe(32)
        self._is_used = False

    def redeem(self, code: str) -> bool:
        """Return whether this is the code, for the first time."""
        if not _equal(self.code, code):
            return False
        if self._is_used:
            _LOG.warning(
                "the address that the browser was started with was opened again without its cookie; if the page is not "
                "open in your browser, another account of this machine may have opened it: start again"
            )
        was_used, self._is_used = self._is_used, True
        return not was_used


def access_for(
    host: str, allow_hosts: Iterable[str] = (), token: bool = True, tokens: Path | None = None, share: bool = False
) -> Access:
    """Return the checks for a server that listens at `host`.

    Args:
        host: address to listen at.
        allow_hosts: names by which browsers may call this machine.
        token: whether requests need a token.
        tokens: private folder that keeps the token of loopback servers between starts, so that open tabs connect
            again; None makes a new one.
        share: make links for other people too, which end with this start.

    Raises:
        TrackerError: `host` is not loopback and `allow_hosts` is empty or no token is wanted, or a name is malformed.
    """
    names = frozenset(name.strip().lower() for name in allow_hosts)
    malformed = sorted(name for name in names if (match := _HOST.fullmatch(name)) is None or match["port"])
    if malformed:
        raise TrackerError(
            f"expected --allow-host to be a host name without port, found '{malformed[0]}'; "
            "give it like lab.example.org"
        )
    if not is_loopback(host) and not token:
        raise TrackerError(
            f"expected a token for a page that other machines reach, found --no-token with --host {host}; "
            "leave out one of them"
        )
    if not is_loopback(host) and not names:
        raise TrackerError(
            f"listening on '{host}' needs the names by which browsers may call this machine, found none; "
            "add --allow-host NAME, or use --host 127.0.0.1 and an SSH tunnel"
        )
    if not token and share:
        raise TrackerError(
            "expected a token for a page that is shared, found --no-token with --share; leave out one of them"
        )
    if not token:
        return Access(names)
    kept = None if tokens is None or not is_loopback(host) or names else kept_token(tokens)
    roles: tuple[Role, ...] = ("annotate", "review", "look") if share else ()
    links = tuple(SharedLink(role, secrets.token_urlsafe(32)) for role in roles)
    return Access(names, kept or secrets.token_urlsafe(32), Invitation(), links)


def is_loopback(name: str) -> bool:
    """Return whether a host name or address, without port, is loopback."""
    if name.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(name.strip("[]")).is_loopback
    except ValueError:
        return False


def _equal(secret: str, found: str) -> bool:
    """Compare in constant time. A request may bring any text, also no Unicode."""
    return secrets.compare_digest(secret.encode(), found.encode("utf-8", "surrogatepass"))


def _shown(text: str) -> str:
    """Return a header for a message; what is no Unicode is escaped."""
    return text.encode("utf-8", "backslashreplace").decode()


def _same(origin: str, called: re.Match[str]) -> bool:
    """Return whether an Origin has the name and port of the Host header."""
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    found = _HOST.fullmatch(parts.netloc)
    if found is None or parts.scheme not in _DEFAULT_PORTS:
        return False
    default = _DEFAULT_PORTS[parts.scheme]
    return _address(found, default) == _address(called, default)


def _address(host: Mapping[str, str] | re.Match[str], default_port: str) -> tuple[str, str]:
    return host["name"].lower(), host["port"] or default_port


_NAME = "token"
_KEPT_S = 7 * 86400.0
"""Age from which a token is replaced."""
_MAX_BYTES = 200


def kept_token(folder: Path) -> str:
    """Return the token kept in a folder, or a new one, which is kept there.

    A file that another account may read, or that is not this user's, is replaced. If the folder cannot be written,
    the token holds for this start alone.

    Args:
        folder: private to this user; made where it is missing.
    """
    path = folder / _NAME
    token = _read(path)
    if token is None:
        token = secrets.token_urlsafe(32)
        with suppress(OSError):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_text_atomic(path, token, mode=0o600)
    return token


def _read(path: Path) -> str | None:
    """Return a token that only this user could have written and read, and that is not too old."""
    try:
        file = system.open_unlinked(path)
    except OSError:
        return None
    with os.fdopen(file, "rb") as opened:
        found = os.fstat(file)
        is_private = stat.S_ISREG(found.st_mode) and system.is_private(found)
        if not is_private or not 0 <= time.time() - found.st_mtime < _KEPT_S:
            return None
        text = opened.read(_MAX_BYTES).decode("ascii", "replace")
    return text if len(text) >= 43 and text.replace("-", "").replace("_", "").isalnum() and text.isascii() else None
