"""The addresses of the program and of its page. Imports little: the first page is served before all else."""

import errno
import socket
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from app.server.access import Access, is_loopback
from tracker.errors import TrackerError

_BACKLOG = 128
_PORTS = range(8080, 8090)
"""Ports of which the first free one is taken where none is named."""


@dataclass(frozen=True)
class Serving:
    """Address and access of the page."""

    host: str = "127.0.0.1"
    port: int | None = None
    """None takes the first free one of a few."""
    allow_hosts: tuple[str, ...] = ()
    browser: bool = True
    """Whether to open the page in the default browser."""
    token: bool = True
    """Whether requests need a token."""
    share: bool = False
    """Whether to make links for other people."""


def listen(host: str, port: int | None) -> list[socket.socket]:
    """Listen at all addresses of a host, at one port.

    Args:
        host: name or address of this machine.
        port: port to listen at; 0 takes a free one, None the first free one of a few.

    Raises:
        TrackerError: the port is taken, or the address is not this machine's.
    """
    if port is None:
        for usual in _PORTS:
            with suppress(TrackerError):
                return listen(host, usual)
        port = _PORTS[0]
    sockets: list[socket.socket] = []
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        for family, *_, address in dict.fromkeys(found):
            at = (address[0], port, *address[2:])
            sockets.append(socket.create_server(at, family=family, backlog=_BACKLOG))
            port = port_of(sockets)
    except (OSError, OverflowError) as error:
        for each in sockets:
            each.close()
        raise TrackerError(_listen_message(host, port, error)) from error
    return sockets


def port_of(sockets: Sequence[socket.socket]) -> int:
    """Return the port of listening sockets."""
    return int(sockets[0].getsockname()[1])


def page_address(access: Access, host: str, port: int) -> str:
    """Return the page's address, with the token if one is required."""
    name = host if is_loopback(host) or not access.hosts else min(access.hosts)
    bracketed = f"[{name}]" if ":" in name and not name.startswith("[") else name
    return f"http://{bracketed}:{port}/" + (f"?token={access.token}" if access.token else "")


def _listen_message(host: str, port: int, error: OSError | OverflowError) -> str:
    number = getattr(error, "errno", None)
    if number == errno.EADDRINUSE:
        return f"expected port {port} of {host} to be free, found it in use; stop the other program or choose --port"
    if number in (errno.EACCES, errno.EPERM):
        return f"expected to be allowed to listen at port {port}, found it refused; choose a --port above 1023"
    return f"cannot listen at {host}, port {port} ({error}); give an address of this machine as --host, a free --port"
