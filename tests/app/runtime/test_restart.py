"""A program that starts again in its process goes on listening."""

import socket
import subprocess
import sys

from app.runtime.restart import inherited

PROGRAM = """
import socket
from app.runtime.restart import inherited, restart

found = inherited()
if found:
    assert inherited() == []
    found[0].accept()[0].sendall(b"again")
else:
    listening = socket.create_server(("127.0.0.1", 0))
    listening.setblocking(False)
    print(listening.getsockname()[1], flush=True)
    input()
    restart([], [listening])
"""


def test_connections_wait_for_the_program_that_starts_again():
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        port = int(program.stdout.readline())
        with socket.create_connection(("127.0.0.1", port), timeout=20) as waiting:
            program.communicate("\n", timeout=20)
            assert waiting.recv(5) == b"again"
    assert program.returncode == 0


def test_sockets_that_are_none_are_passed_over(monkeypatch):
    monkeypatch.setenv("QUADRILLE_LISTENING", "98765")
    assert inherited() == []
