"""What the port answers while the program starts."""

import http.client
import json
import socket
import subprocess
import sys

import pytest
from gestures import wait_for

from app.server.address import Serving
from app.server.doorway import STEPS, Doorway


@pytest.fixture
def doorway(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with Doorway(Serving(port=0, browser=False)) as it:
        yield it


def get(doorway, path, **headers):
    """Status, policy and content of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", doorway.port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, answer.headers, content.decode()


def test_the_page_says_what_the_program_is_doing(doorway):
    status, headers, page = get(doorway, "/?token=x")
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert doorway.access.token not in page
    for name in ("static/theme.js", "static/styles/tokens.css", "static/starting/starting.js"):
        assert name in page
        assert get(doorway, f"/{name}")[0] == 200
    for at, step in enumerate(STEPS):
        doorway.show(step)
        assert json.loads(get(doorway, "/starting.json")[2]) == {"steps": list(STEPS), "at": at}


@pytest.mark.parametrize(
    "path", ["/static/main.js", "/static/../app/__main__.py", "/static/%2e%2e/pyproject.toml", "/ws"]
)
def test_nothing_else_is_read(doorway, path):
    assert get(doorway, path)[0] == 503


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}])
def test_other_names_and_pages_are_refused(doorway, headers):
    status, _, text = get(doorway, "/", **headers)
    assert status == 403
    assert "refused" in text


def test_connections_that_say_nothing_hold_nobody_up(doorway):
    silent = [socket.create_connection(("127.0.0.1", doorway.port)) for _ in range(20)]
    assert get(doorway, "/starting.json")[0] == 200
    for each in silent:
        each.close()


def test_who_comes_next_serves_the_same_port(doorway):
    doorway.close()
    with socket.create_connection(("127.0.0.1", doorway.port)) as waiting:
        accepted, _ = doorway.sockets[0].accept()
        accepted.sendall(b"next")
        assert waiting.recv(4) == b"next"
        accepted.close()


def test_the_browser_is_opened_with_an_invitation(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    opened = []
    monkeypatch.setattr("app.server.doorway.webbrowser.open", opened.append)
    with Doorway(Serving(port=0)) as doorway:
        doorway.open_browser()
        wait_for(lambda: opened)
    assert doorway.access.invitation.code in opened[0]
    assert doorway.access.token not in opened[0]


def test_nobody_listens_afterwards(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with Doorway(Serving(port=0, browser=False)) as doorway:
        pass
    assert [each.fileno() for each in doorway.sockets] == [-1] * len(doorway.sockets)


BEFORE_THE_DOORWAY = """
import sys
import app.__main__
from app.cli import open
from app.runtime.kernel_compiler import KernelCompiler
from app.server.doorway import Doorway
from app.session.samples import sample_copy
from tracker.compute.kernel_cache import is_compiled
from tracker.session.folder import session_folder
from tracker.session.lock import SessionLock

is_compiled()
print(*sorted({"numba", "numpy", "cv2", "av", "scipy", "viser", "aiohttp"} & sys.modules.keys()))
"""


def test_the_port_answers_and_kernels_are_compiled_before_anything_large_is_loaded():
    loaded = subprocess.run([sys.executable, "-c", BEFORE_THE_DOORWAY], capture_output=True, text=True, check=True)
    assert loaded.stdout.split() == []
