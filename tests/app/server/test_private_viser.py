"""viser is reached through the page's own port, or not at all."""

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import aiohttp
import pytest
import viser
import websockets.asyncio.server

from app.server import private_viser
from app.server.private_viser import SECRET, PrivateViser
from tracker import system
from tracker.errors import TrackerError
from tracker.system import IS_PORTABLE

ROOT = Path(__file__).resolve().parents[3]
EVIL = "http://evil.example"
VISER = f"viser-v{viser.__version__}"
LISTENING = "0A"
on_linux = pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads the ports of a process from /proc")


def listening_ports(pid):
    """TCP ports that a process listens on, as addresses of this machine that reach them."""
    sockets = set()
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        try:
            sockets.add(os.readlink(entry))
        except FileNotFoundError:
            continue
    ports = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == LISTENING and f"socket:[{fields[9]}]" in sockets:
                ports.add(int(fields[1].rpartition(":")[2], 16))
    return ports


@contextmanager
def program(session, *options, is_portable=IS_PORTABLE):
    """`quadrille open` as a user starts it; gives the process and the page's address."""
    words = [sys.executable, "-m", "quadrille", "open", str(session), "--no-browser", "--port", "0", *options]
    env = {**os.environ, "PYTHONUNBUFFERED": "1", "QUADRILLE_PORTABLE": str(int(is_portable))}
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=env)
    try:
        address = next(line.partition(": ")[2].strip() for line in process.stdout if ": http://" in line)
        yield process, address
    finally:
        process.terminate()
        process.wait(30)


SCENE_BYTES = 10_000
"""What is received of a viser client's first messages when it is given the scene."""


async def scene_bytes(url, patience_s=1.0, **options):
    """How much of the scene a viser client is sent while it waits so long for each message; 0 where it is refused."""
    received = 0
    async with aiohttp.ClientSession() as client:
        try:
            async with client.ws_connect(url, protocols=[VISER], max_msg_size=0, **options) as sock:
                while (
                    received <= SCENE_BYTES
                    and (message := await sock.receive(timeout=patience_s)).type is aiohttp.WSMsgType.BINARY
                ):
                    received += len(message.data)
        except (aiohttp.ClientError, TimeoutError):
            pass
    return received


@on_linux
@pytest.mark.parametrize(
    ("options", "is_portable"),
    [
        pytest.param((), False, marks=pytest.mark.slow),
        pytest.param((), True, marks=pytest.mark.slow),
        (("--host", "0.0.0.0", "--allow-host", "lab.example.org"), IS_PORTABLE),
    ],
)
async def test_no_port_of_the_program_gives_the_scene_to_a_stranger(session, options, is_portable):
    with program(session, *options, is_portable=is_portable) as (process, address):
        ports = listening_ports(process.pid)
        _, _, rest = address.removeprefix("http://").partition(":")
        page_port, _, query = rest.partition("/")
        assert len(ports) == 1 + is_portable  # without Unix sockets viser has one
        assert int(page_port) in ports
        assert await scene_bytes(f"http://127.0.0.1:{page_port}/viser/{query}", 10.0) > SCENE_BYTES  # the page itself
        for port in ports:
            for path in ("/", "/viser", "/viser/", "/ws"):
                url = f"http://127.0.0.1:{port}{path}"
                assert await scene_bytes(url + query, origin=EVIL) == 0
                assert await scene_bytes(url) == 0, "the token was not asked for"
        assert not any(b"viser" in part for part in await pages(ports))


async def pages(ports):
    """What a foreign page reads at the root of each port."""
    async with aiohttp.ClientSession() as client:
        return [
            await (await client.get(f"http://127.0.0.1:{port}/viser/", headers={"Origin": EVIL})).read()
            for port in ports
        ]


@pytest.mark.slow
async def test_a_port_of_viser_asks_for_the_secret(monkeypatch):
    monkeypatch.setattr(system, "HAS_UNIX_SOCKETS", False)
    started = PrivateViser()
    try:
        assert started.place.path is None
        url = f"http://127.0.0.1:{started.place.port}/"
        assert await scene_bytes(url) == await scene_bytes(url, headers={SECRET: "guessed"}) == 0
        assert await scene_bytes(url, headers={SECRET: started.place.secret}) > 0
        assert not any(b"viser" in part for part in await pages([started.place.port]))
    finally:
        started.stop()


@on_linux
@pytest.mark.skipif(IS_PORTABLE, reason="viser has a port")
def test_viser_listens_on_no_port_and_only_its_user_may_enter(capfd):
    before = listening_ports(os.getpid())
    started = PrivateViser()
    try:
        assert listening_ports(os.getpid()) == before
        assert started.place.path.is_socket()
        assert started.place.path.parent.stat().st_mode & 0o777 == 0o700
    finally:
        started.stop()
    assert not started.place.path.parent.exists()
    assert "http" not in capfd.readouterr().out


def test_a_viser_that_does_not_take_the_socket_is_not_used(monkeypatch, tmp_path):
    original = websockets.asyncio.server.serve

    class Elsewhere(viser.ViserServer):
        def __init__(self, **options):
            websockets.asyncio.server.serve = original  # a version that serves by another way
            super().__init__(**options)

    monkeypatch.setattr(private_viser.viser, "ViserServer", Elsewhere)
    monkeypatch.setattr(private_viser.tempfile, "tempdir", str(tmp_path))
    with pytest.raises(TrackerError, match="expected viser to listen on a private socket"):
        PrivateViser()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(IS_PORTABLE, reason="viser has no socket")
def test_a_long_temporary_folder_is_avoided(monkeypatch, tmp_path):
    long = tmp_path / ("long" * 30)
    long.mkdir()
    monkeypatch.setattr(private_viser.tempfile, "tempdir", str(long))
    started = PrivateViser()
    assert started.place.path.is_socket()
    started.stop()
    assert list(long.iterdir()) == []
