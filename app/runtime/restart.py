"""Replace the process by the same program with other words, which goes on listening at the same sockets."""

import os
import socket
import sys
from collections.abc import Sequence

_LISTENING = "QUADRILLE_LISTENING"
"""Variable of the environment that names the descriptors of the sockets, separated by commas."""


def restart(words: Sequence[str], listening: Sequence[socket.socket] = ()) -> None:
    """Start the program again in this process, with other words; does not return.

    Views work in daemon threads, and caches hold images. A new program has neither.

    Args:
        words: of the command line, without the name of the program.
        listening: sockets that the new program takes over, so that no connection is refused meanwhile.
    """
    for each in listening:
        each.set_inheritable(True)
    os.environ[_LISTENING] = ",".join(str(each.fileno()) for each in listening)
    own = len(sys.argv) - 1
    program = sys.orig_argv[1 : len(sys.orig_argv) - own]
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(sys.executable, [sys.executable, *program, *words])


def inherited() -> list[socket.socket]:
    """Return the sockets that `restart` has left to this program, on the first call; none where they cannot be kept."""
    numbers = os.environ.pop(_LISTENING, "")
    try:
        found = [socket.socket(fileno=int(number)) for number in numbers.split(",") if number]
    except (OSError, ValueError):
        return []
    for each in found:
        each.set_inheritable(False)
        each.setblocking(True)
    return found
