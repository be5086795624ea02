"""Exports that the page downloads."""

import asyncio
import io
import json
import tempfile
import threading
import zipfile

import aiohttp
import pytest
from bodies import MODELS
from observed_people import BODY_25, seen, walking, write_openpose
from serving import listening
from stored_motions import store_motion

from app.server import server
from app.server.access import Access
from app.server.export_routes import ExportRoutes
from app.server.static_files import static_folder
from tracker.formats.trc import write_trc
from tracker.interchange.exports import formats
from tracker.interchange.exports.export_format import ExportFormat
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.request import ImportRequest
from tracker.session.session import load_session


class Nobody:
    async def serve(self, socket, role, name=""):
        pass


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The system's folder for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
async def client(tmp_path, temporary):
    folder = tmp_path / "dance"
    store_motion(folder, [MODELS["gavrila22"]] * 2, gaps={(0, 3)})
    app = server.create_app(Nobody(), tmp_path / "nobody", Access(token="secret"), static_folder())
    ExportRoutes(folder).add_to(app)
    async with listening(app) as port, aiohttp.ClientSession(f"http://127.0.0.1:{port}") as session:
        session.cookie_jar.update_cookies({f"quadrille_{port}": "secret"})
        yield session


async def test_files_are_made_sent_and_deleted(client, temporary):
    async with client.get("/export") as response:
        listed = await response.json()
    assert [f["name"] for f in listed] == list(formats.FORMATS)
    assert all({"frames", "only", "skip_lost"} <= set(f["options"]) for f in listed)
    assert {f["name"]: f["axes"] for f in listed}["bvh"] == "y-up"
    assert {f["name"] for f in listed if "Frame# {number}" in f["numbering"]} == {"trc"}
    async with client.get("/export/trc?person=ann&frames=1:5&axes=y-up&units=mm") as response:
        assert response.status == 200
        assert response.headers["Content-Disposition"] == "attachment; filename*=UTF-8''dance_ann.trc"
        rows = (await response.text()).splitlines()
    assert rows[2].split("\t")[4] == "mm"
    assert [row.split("\t")[0] for row in rows[6:]] == ["2", "3", "4", "5"]
    async with client.get("/export/mot?frames=0:2") as response:
        archive = zipfile.ZipFile(io.BytesIO(await response.read()))
    assert sorted(archive.namelist()) == ["dance_ann.mot", "dance_ann.osim", "dance_bob.mot", "dance_bob.osim"]
    async with client.get("/export/progress") as response:
        assert await response.json() == {"done": 0, "total": 0}
    async with client.get("/export/openpose?frames=1,2&pixels=original") as response:
        archive = zipfile.ZipFile(io.BytesIO(await response.read()))
    assert "dance_openpose/cam0_json/cam0_000000000002_keypoints.json" in archive.namelist()
    async with client.get("/export/trc?person=ann&only=keyframes&provenance=1") as response:
        archive = zipfile.ZipFile(io.BytesIO(await response.read()))
    assert sorted(archive.namelist()) == ["dance_ann.trc", "dance_ann.trc.provenance.json"]
    assert [p["frame"] for p in json.loads(archive.read(archive.namelist()[1]))["people"]["ann"]] == [1]
    assert list(temporary.iterdir()) == []


async def test_observations_are_sent_back_in_their_own_files(client, temporary, tmp_path):
    session = load_session(tmp_path / "dance")
    points = seen(session, [walking(session.n_frames)])
    folder = write_openpose(tmp_path / "net", session.camera_names, points)
    track = tmp_path / "net.trc"
    write_trc(track, BODY_25.points, walking(session.n_frames), session.fps)
    for name, path in (("net", folder), ("joints", track)):
        store_import(session, plan_import(session, ImportRequest(name, (path,), ("ann",))))
    async with client.get("/export") as response:
        sent = [f for f in await response.json() if f["name"] not in formats.FORMATS]
    assert [(f["name"], f["title"], f["options"]) for f in sent] == [
        ("like/joints", "joints, as it came", ["poses"]), ("like/net", "net, as it came", ["poses"])
    ]  # fmt: skip
    async with client.get("/export/like/net") as response:
        assert response.headers["Content-Disposition"] == "attachment; filename*=UTF-8''net.zip"
        archive = zipfile.ZipFile(io.BytesIO(await response.read()))
    came = {f"net/{p.relative_to(folder)}": p.read_bytes() for p in folder.rglob("*.json")}
    assert set(archive.namelist()) == came.keys()
    changed = {n for n in came if archive.read(n) != came[n]}
    assert changed == {f"net/{c}/{c}_000000000001_keypoints.json" for c in session.camera_names}  # the keyframe
    async with client.get("/export/like/joints") as response:
        assert response.headers["Content-Disposition"] == "attachment; filename*=UTF-8''net.trc"
        edited = await response.read()
    async with client.get("/export/like/joints?poses=all") as response:
        replaced = await response.read()
    before = track.read_bytes().split(b"\n")
    differ = [sum(a != b for a, b in zip(before, now.split(b"\n"), strict=True)) for now in (edited, replaced)]
    assert differ == [1, session.n_frames - 1]  # frame 3 has no pose
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("path", "status", "expected"),
    [
        ("like/none", 400, "expected the name of imported observations, found 'none'"),
        ("like/..%2F..%2Fetc", 400, "expected the name of imported observations"),
        ("like/none?poses=best", 400, "expected poses as edited or all, found 'best'"),
        ("mp4?character=%2Fetc%2Fbody.toml", 400, "expected a character among"),
        ("fbx", 404, "Expected a format of trc, csv"),
        ("..%2F..%2Fetc%2Fpasswd", 404, "Expected a format"),
        ("trc?person=..%2Fann", 400, "expected a person of ann, bob, found '../ann'"),
        ("trc?frames=5:99", 400, "expected frames as A:B within 0:8"),
        ("trc?frames=²:9", 400, "expected frames as A:B"),
        ("trc?only=best", 400, "expected only as keyframes or reviewed"),
        ("trc?axes=up", 400, "expected --axes to be one of"),
        ("mp4?view=%2Fdev%2Fzero", 400, "expected --view to be one of cam0, cam1, cam2"),
        ("trc?frames=3:4&person=ann", 400, "expected poses of 'ann' in frames 3:4, found none"),
        ("mp4", 400, "not found"),
    ],
)
async def test_wrong_requests_are_answered_with_the_reason(client, temporary, path, status, expected):
    async with client.get(f"/export/{path}") as response:
        assert response.status == status
        assert expected in await response.text()
    assert list(temporary.iterdir()) == []


async def test_strangers_and_foreign_pages_get_nothing(client):
    for path in ("/export/trc", "/export/like/net"):
        async with client.get(path, headers={"Sec-Fetch-Site": "cross-site"}) as response:
            assert response.status == 403
    client.cookie_jar.clear()
    for path in ("/export", "/export/progress", "/export/trc", "/export/like/net"):
        async with client.get(path) as response:
            assert response.status == 403


async def test_one_runs_at_a_time_and_stops_when_the_page_goes(client, temporary, monkeypatch):
    reached, go_on = asyncio.Event(), threading.Event()
    loop = asyncio.get_running_loop()

    def slow(motion, options, paths, tick):
        while not go_on.wait(0.01):
            tick()
            loop.call_soon_threadsafe(reached.set)

    one = formats.FORMATS["coco"]
    monkeypatch.setitem(formats.FORMATS.own, "coco", ExportFormat("coco", one.title, one.suffixes, slow))
    try:
        first = asyncio.create_task(client.get("/export/coco"))
        await asyncio.wait_for(reached.wait(), 20)
        async with client.get("/export/csv") as response:
            assert response.status == 409
            assert "Another export is in progress" in await response.text()
        first.cancel()
        async with asyncio.timeout(20):
            while list(temporary.iterdir()):
                await asyncio.sleep(0.02)
        async with client.get("/export/csv") as response:
            assert response.status == 200
    finally:
        go_on.set()
