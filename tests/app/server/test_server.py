import asyncio
import re
from contextlib import asynccontextmanager

import aiohttp
import pytest
from aiohttp import web
from serving import NO_VISER, answer, listening, running
from yarl import URL

from app.server import address, server
from app.server.access import Access, Invitation, access_for
from app.server.connections import LimitedRunner
from app.server.private_viser import ViserPlace
from app.server.static_files import static_folder
from tracker.errors import TrackerError

NAMED = Access(frozenset({"lab.example.org"}), "secret", Invitation())


class EchoPanes:
    """A pane endpoint that answers every message with itself."""

    async def serve(self, socket, role, name=""):
        async for message in socket:
            if message.type is aiohttp.WSMsgType.TEXT:
                await socket.send_str(message.data.decode())


class FakeViser:
    """Stands for viser: remembers what it was asked, echoes, and closes when told to."""

    def __init__(self):
        self.requests = []
        self.close_codes = []

    async def handle(self, request):
        self.requests.append(request)
        if request.headers.get("Upgrade", "").lower() != "websocket":
            return web.Response(body=b"viser " + request.raw_path.encode(), content_type="text/html")
        sock = web.WebSocketResponse(protocols=["viser-v1.1.1"], max_msg_size=0)
        await sock.prepare(request)
        async for message in sock:
            if message.data == "close":
                await sock.close(code=4001, message=b"told to")
            elif message.type is aiohttp.WSMsgType.TEXT:
                await sock.send_str(message.data)
            else:
                await sock.send_bytes(message.data)
        self.close_codes.append(sock.close_code)
        return sock


@asynccontextmanager
async def listening_at(app, path):
    """Serve on a Unix socket."""
    runner = web.AppRunner(app, shutdown_timeout=1.0)
    await runner.setup()
    await web.UnixSite(runner, path).start()
    try:
        yield path
    finally:
        await runner.cleanup()


@pytest.fixture
async def fake_viser(tmp_path):
    fake = FakeViser()
    app = web.Application()
    app.router.add_get("/{path:.*}", fake.handle)
    async with listening_at(app, tmp_path / "viser") as path:
        fake.place = ViserPlace(path, 0, "secret")
        yield fake


@pytest.fixture
def access():
    return Access()


@pytest.fixture
async def port(fake_viser, access):
    app = server.create_app(EchoPanes(), fake_viser.place, access, static_folder())
    async with listening(app) as port:
        yield port


@pytest.fixture
async def client(port):
    async with aiohttp.ClientSession(f"http://127.0.0.1:{port}") as session:
        yield session


async def echo(socket):
    await socket.send_str("hello")
    assert await socket.receive_str() == "hello"


async def raw_get(port, target, host="localhost"):
    """Send a request whose target no client library has tidied up; return status and the whole answer."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(f"GET {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n".encode())
    answer = await reader.read()
    writer.close()
    return int(answer.split()[1]), answer


async def test_page_and_modules_are_served_with_their_headers(client):
    async with client.get("/") as response:
        assert response.status == 200
        assert response.content_type == "text/html"
        policy = response.headers["Content-Security-Policy"]
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert response.headers["X-Content-Type-Options"] == "nosniff"
    async with client.get("/static/main.js") as response:
        assert response.status == 200
        assert "javascript" in response.content_type
        assert response.headers["Cache-Control"] == "no-cache"
        tag = response.headers["ETag"]
    assert (await answer(client, "/static/main.js", **{"If-None-Match": tag}))[0] == 304


async def test_files_are_kept_under_the_version_that_the_page_names(client):
    _, page = await answer(client, "/")
    (address,) = re.findall(r'src="(static/[0-9a-f]{16}/main\.js)"', page)
    assert re.findall(r'"(static/(?:theme|styles)[^"]*)"', page) == []
    async with client.get(f"/{address}") as response:
        assert response.content_type == "text/javascript"
        assert "immutable" in response.headers["Cache-Control"]
        script = await response.text()
    assert "// model/store.js\n" in script


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["nothing.js", "index.html", "model/store.js", "..%2fmain.js", "%2e%2e/pyproject.toml"]
)
async def test_no_other_file_has_a_version(port, name):
    assert (await raw_get(port, f"/static/{'0' * 16}/{name}"))[0] in (403, 404)


@pytest.mark.parametrize("path", ["/", "/static/main.js", "/ws", "/viser/", "/viser", "/nothing"])
@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "http://localhost:1"}],
)
async def test_foreign_requests_get_403(client, fake_viser, path, headers):
    status, text = await answer(client, path, **headers)
    assert (status, "refused" in text) == (403, True)
    assert not fake_viser.requests


@pytest.mark.parametrize("path", ["/ws", "/viser", "/viser/"])
async def test_foreign_sockets_get_403(client, path):
    with pytest.raises(aiohttp.WSServerHandshakeError) as caught:
        await client.ws_connect(path, origin="http://evil.example")
    assert caught.value.status == 403


async def test_a_request_through_a_port_forward_passes_by_its_own_name_only(port):
    async with aiohttp.ClientSession() as session:
        url = f"http://127.0.0.1:{port}/ws"
        tunnel = {"Host": "localhost:9999"}
        async with session.ws_connect(url, headers=tunnel, origin="http://localhost:9999") as sock:
            await echo(sock)
        for path in ("", "ws", "viser/"):
            headers = tunnel | {"Origin": "http://evil.example"}
            assert (await answer(session, f"http://127.0.0.1:{port}/{path}", **headers))[0] == 403


@pytest.mark.parametrize("prefix", ["/static/", "/viser/", "/"])
@pytest.mark.parametrize(
    "climb", ["../pyproject.toml", "%2e%2e/pyproject.toml", "..%2fpyproject.toml", "%2e%2e%5cpyproject.toml"]
)
async def test_dots_reach_no_file(port, fake_viser, prefix, climb):
    status, answer = await raw_get(port, prefix + climb)
    assert status in (403, 404)
    assert b"hatchling" not in answer
    assert not fake_viser.requests


async def test_doubly_encoded_dots_reach_no_file(port, fake_viser):
    assert (await raw_get(port, "/viser/%252e%252e/secret"))[0] == 404
    assert not fake_viser.requests


async def test_viser_is_fetched_below_its_own_root(client, fake_viser):
    async with client.get(URL("/viser/a%20b?darkMode=", encoded=True)) as response:
        assert response.status == 200
        assert await response.text() == "viser /a%20b?darkMode="
        assert "frame-ancestors 'self'" in response.headers["Content-Security-Policy"]
    assert "Origin" not in fake_viser.requests[0].headers
    async with client.get("/viser", allow_redirects=False) as response:
        assert response.status == 302
        assert response.headers["Location"] == "viser/"


@pytest.mark.parametrize("path", ["/viser", "/viser/"])
async def test_viser_socket_keeps_protocol_kinds_and_large_messages(client, path):
    async with client.ws_connect(path, protocols=["viser-v1.1.1"], max_msg_size=0) as sock:
        assert sock.protocol == "viser-v1.1.1"
        await sock.send_str("text")
        assert await sock.receive_str() == "text"
        large = bytes(9 << 20)
        await sock.send_bytes(large)
        assert await sock.receive_bytes() == large


async def test_viser_socket_closes_with_visers_reason(client):
    async with client.ws_connect("/viser", protocols=["viser-v1.1.1"]) as sock:
        await sock.send_str("close")
        message = await sock.receive()
        assert (message.type, message.data, message.extra) == (aiohttp.WSMsgType.CLOSE, 4001, "told to")


async def test_a_page_that_leaves_closes_its_viser_socket(client, fake_viser):
    sock = await client.ws_connect("/viser", protocols=["viser-v1.1.1"])
    await sock.close(code=1000)
    async with asyncio.timeout(20.0):
        while not fake_viser.close_codes:
            await asyncio.sleep(0.01)
    assert fake_viser.close_codes == [1000]


async def test_without_viser_the_proxy_says_so(tmp_path):
    app = server.create_app(EchoPanes(), NO_VISER, Access(), static_folder())
    async with (
        listening(app) as port,
        aiohttp.ClientSession() as session,
        session.get(f"http://127.0.0.1:{port}/viser/") as response,
    ):
        assert response.status == 502


class TestToken:
    @pytest.fixture
    def access(self):
        return NAMED

    async def test_address_gives_a_cookie_and_the_cookie_opens_everything(self, client):
        host = {"Host": "lab.example.org:8080"}
        for path in ("/", "/?token=guess", "/static/main.js", "/ws", "/viser/"):
            assert (await answer(client, path, **host))[0] == 403
        async with client.get("/?token=secret", headers=host) as response:
            assert response.status == 200
            cookie = response.cookies[NAMED.cookie(host["Host"])]
            assert cookie["httponly"]
            assert cookie["samesite"] == "Strict"
            assert cookie["path"] == response.headers["Content-Location"] == NAMED.root
            assert f'url={NAMED.root}"' in await response.text()
        holder = host | {"Cookie": f"{cookie.key}={cookie.value}"}
        for path in ("/", "/static/main.js", "/viser/"):
            assert (await answer(client, path, **holder))[0] == 200
        async with client.ws_connect("/ws", headers=holder) as sock:
            await echo(sock)

    async def test_everything_is_served_below_the_root_to_those_who_have_the_cookie(self, fake_viser):
        app = server.create_app(EchoPanes(), fake_viser.place, NAMED, static_folder())
        async with running(LimitedRunner(app, NAMED.roots)) as port, aiohttp.ClientSession() as session:
            root, name = f"http://127.0.0.1:{port}{NAMED.root}", NAMED.cookie(f"127.0.0.1:{port}")
            for path in ("", "static/main.js", "viser/", "ws"):
                assert (await answer(session, root + path))[0] == 403  # the path alone does not admit
            holder = {"Cookie": f"{name}={NAMED.token}"}
            for path, content in (("", b"<html"), ("static/main.js", b"import"), ("viser/a%20b?c", b"viser /a%20b?c")):
                async with session.get(URL(root + path, encoded=True), headers=holder) as response:
                    assert (response.status, content in await response.read()) == (200, True)
            async with session.ws_connect(root + "ws", headers=holder) as sock:
                await echo(sock)

    @pytest.mark.parametrize("token", ["\xe9", "secret\xe9", "%C3%A9", "%ED%A0%80", "\u20ac"])
    async def test_a_token_that_is_not_ascii_is_refused_like_any_other(self, port, token):
        for line in (f"/?token={token} HTTP/1.1", f"/ HTTP/1.1\r\nCookie: {NAMED.cookie('localhost')}={token}"):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(f"GET {line}\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
            status = int((await reader.read()).split()[1])
            writer.close()
            assert status in (400, 403)

    async def test_the_address_that_a_browser_is_started_with_admits_once(self, client, caplog):
        invited = {"token": NAMED.invitation.code}
        async with client.get("/", params=invited) as response:
            assert response.status == 200
            (cookie,) = response.cookies.values()
            assert cookie.value == NAMED.token
        holder = {"Cookie": f"{cookie.key}={cookie.value}"}  # the client keeps no cookies of addresses without a name
        async with client.get("/", params=invited, headers=holder) as response:  # loaded again
            assert response.status == 200
        assert not caplog.records
        async with client.get("/", params=invited) as response:
            assert response.status == 403
        assert "another account" in caplog.text

    async def test_a_typed_address_names_the_one_to_open(self, client):
        status, text = await answer(client, "/")
        assert (status, "open the address that quadrille open printed" in text) == (403, True)


@pytest.mark.slow
@pytest.mark.parametrize("prefix", ["/", "/static/", "/static/a/", "/viser/", "/ws/"])
@pytest.mark.parametrize("name", ["a" * 300, "a" * 1900, "a" * 7000, "a/" * 3000, "%C3%A9" * 200, "a" * 70_000, "%00"])
async def test_long_paths_are_not_found(port, fake_viser, caplog, prefix, name):
    status, _ = await raw_get(port, prefix + name)
    assert status in (400, 404, 414) or (prefix, name) == ("/viser/", "%00")


def test_a_busy_port_is_refused_if_named_and_passed_over_if_not():
    (busy,) = address.listen("127.0.0.1", 0)
    port = address.port_of([busy])
    with busy, pytest.raises(TrackerError, match=rf"port {port} .* in use; .*--port"):
        address.listen("127.0.0.1", port)
    (usual,), (following,) = address.listen("127.0.0.1", None), address.listen("127.0.0.1", None)
    with usual, following:
        assert 8080 <= address.port_of([usual]) < address.port_of([following]) < 8090


async def test_serving_closes_its_sockets_at_the_end():
    ready = asyncio.get_running_loop().create_future()
    sockets = address.listen("127.0.0.1", 0)
    app = server.create_app(EchoPanes(), NO_VISER, Access(), static_folder())
    task = asyncio.create_task(server.serve_forever(app, sockets, lambda: ready.set_result(True)))
    await asyncio.wait_for(ready, 20.0)
    url = address.page_address(Access(), "127.0.0.1", address.port_of(sockets))
    async with aiohttp.ClientSession() as session, session.ws_connect(url + "ws") as sock:
        task.cancel()
        message = await sock.receive(timeout=20.0)
        assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, aiohttp.WSCloseCode.GOING_AWAY)
        with pytest.raises(asyncio.CancelledError):
            await task


def test_page_address_carries_name_and_token():
    assert address.page_address(Access(), "127.0.0.1", 8080) == "http://127.0.0.1:8080/"
    assert address.page_address(Access(), "::1", 8080) == "http://[::1]:8080/"
    assert address.page_address(NAMED, "0.0.0.0", 8080) == "http://lab.example.org:8080/?token=secret"


class TellingPanes:
    """A pane endpoint that says who has joined."""

    async def serve(self, socket, role, name=""):
        await socket.send_str(role)


async def _answer(_):
    return web.Response()


@pytest.mark.parametrize("role", ["annotate", "review", "look"])
async def test_a_shared_link_shows_the_session_and_no_more(fake_viser, role):
    access = access_for("127.0.0.1", share=True)
    app = server.create_app(TellingPanes(), fake_viser.place, access, static_folder())
    app.router.add_get("/sessions", _answer)
    async with running(LimitedRunner(app, access.roots)) as port, aiohttp.ClientSession() as client:
        start = f"http://127.0.0.1:{port}"
        async with client.get(start, params={"token": access.token_of(role)}) as entry:
            assert entry.status == 200
            root, kept = entry.headers["Content-Location"], entry.headers["Set-Cookie"]
        assert f"Path={root}" in kept
        assert access.token not in kept
        client.headers["Cookie"] = kept.partition(";")[0]
        async with client.get(start + root) as page:
            assert page.status == 200
        async with client.ws_connect(f"{start}{root}ws") as socket:
            assert await socket.receive_str() == role
        for path in ("viser/", "sessions", "export"):
            async with client.get(start + root + path) as refused:
                assert refused.status == 403
                assert "page of the host" in await refused.text()
        async with client.post(start + root) as refused:
            assert refused.status == 403
