"""What the port answers while the program starts."""

import http.client
import json
import os
import re
import socket
import subprocess
import sys

import pytest
from gestures import wait_for

from app.server import startup_server as doorways
from app.server.address import Serving
from app.server.startup_server import STEPS, StartupServer
from app.server.static_files import KEPT, PageFiles, static_folder


@pytest.fixture
def doorway(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with StartupServer(Serving(port=0, browser=False)) as it:
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
    assert "ws://127.0.0.1" in headers["Content-Security-Policy"]  # the page connects later, without being loaded again
    assert doorway.access.token not in page
    assert "<html data-starting" in page
    for at, step in enumerate(STEPS):
        doorway.show(step)
        told = {"steps": list(STEPS), "at": at}
        wait_for(lambda told=told: json.loads(get(doorway, "/starting.json")[2]) == told)


@pytest.mark.slow
def test_the_files_of_the_page_are_kept(doorway):
    page = get(doorway, "/")[2]
    addresses = re.findall(r'"(static/[^"]+)"', page)
    assert {address.rpartition("/")[2] for address in addresses} == {
        "icon.svg",
        "theme.js",
        "index.css",
        "index.js",
        "main.js",
    }
    for address in addresses:
        status, headers, _ = get(doorway, f"/{address}")
        assert (status, headers["Cache-Control"]) == (200, "no-store" if "icon" in address else KEPT)
    assert get(doorway, "/")[1]["Cache-Control"] == "no-store"
    assert PageFiles(static_folder()).index() == page.replace("<html data-starting", "<html", 1)


@pytest.mark.skipif(not doorways.FORKS, reason="threads answer on this system")
def test_a_process_of_its_own_answers_and_ends_with_the_program(monkeypatch, tmp_path):
    """However the program ends: the port is free again."""
    code = (
        "import os, sys; from app.server.startup_server import StartupServer; from app.server.address import Serving\n"
    )
    code += (
        "with StartupServer(Serving(port=0)) as d: print(d.port, d._process.pid, flush=True); os.kill(os.getpid(), 9)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    port, process = map(int, ended.stdout.split())

    def is_free():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) != 0

    assert process != os.getpid()
    wait_for(is_free)


def test_threads_answer_where_a_process_cannot(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(doorways, "FORKS", False)
    with StartupServer(Serving(port=0, browser=False)) as doorway:
        doorway.show(STEPS[1])
        assert json.loads(get(doorway, "/starting.json")[2])["at"] == 1


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/static/main.js", "/static/../app/main.py", "/static/%2e%2e/pyproject.toml", "/ws"])
def test_nothing_else_is_read(doorway, path):
    assert get(doorway, path)[0] == 503


@pytest.mark.slow
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


def test_the_next_program_serves_the_same_port(doorway):
    doorway.close()
    with socket.create_connection(("127.0.0.1", doorway.port)) as waiting:
        accepted, _ = doorway.sockets[0].accept()
        accepted.sendall(b"next")
        assert waiting.recv(4) == b"next"
        accepted.close()


def test_the_browser_is_opened_with_an_invitation(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    opened = []
    monkeypatch.setattr("app.server.startup_server.webbrowser.open", opened.append)
    with StartupServer(Serving(port=0)) as doorway:
        doorway.open_browser()
        wait_for(lambda: opened)
    assert doorway.access.invitation.code in opened[0]
    assert doorway.access.token not in opened[0]


def test_nobody_listens_afterwards(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with StartupServer(Serving(port=0, browser=False)) as doorway:
        pass
    assert [each.fileno() for each in doorway.sockets] == [-1] * len(doorway.sockets)


BEFORE_THE_DOORWAY = """
import sys
import app.main
from app.cli import open
from app.runtime.kernel_compiler import KernelCompiler
from app.server.startup_server import StartupServer
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
