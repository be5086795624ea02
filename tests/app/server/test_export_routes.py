"""Exports that the page downloads."""

import asyncio
import io
import json
import tempfile
import threading
import zipfile

import pytest
from bodies import MODELS
from observed_people import BODY_25, seen, walking, write_openpose
from serving import page_of
from stored_motions import store_motion

from app.server.export_routes import ExportRoutes
from tracker.formats.trc import write_trc
from tracker.interchange.exports import formats
from tracker.interchange.exports.formats import ExportFormat
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.session.session import load_session


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The system's folder for temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
async def page(tmp_path, temporary):
    folder = tmp_path / "dance"
    store_motion(folder, [MODELS["gavrila22"]] * 2, gaps={(0, 3)})
    async with page_of(ExportRoutes(folder)) as page:
        yield page


@pytest.fixture
def client(page):
    return page.session


async def sent_archive(client, path):
    async with client.get(path) as response:
        return zipfile.ZipFile(io.BytesIO(await response.read()))


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
    archive = await sent_archive(client, "/export/mot?frames=0:2")
    assert sorted(archive.namelist()) == ["dance_ann.mot", "dance_ann.osim", "dance_bob.mot", "dance_bob.osim"]
    async with client.get("/export/progress") as response:
        assert await response.json() == {"done": 0, "total": 0}
    archive = await sent_archive(client, "/export/openpose?frames=1,2&pixels=original")
    assert "dance_openpose/cam0_json/cam0_000000000002_keypoints.json" in archive.namelist()
    archive = await sent_archive(client, "/export/trc?person=ann&only=keyframes&provenance=1")
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
async def test_wrong_requests_are_answered_with_the_reason(page, temporary, path, status, expected):
    answered, text = await page.get(f"/export/{path}")
    assert answered == status
    assert expected in text
    assert list(temporary.iterdir()) == []


async def test_strangers_and_foreign_pages_get_nothing(page):
    for path in ("/export/trc", "/export/like/net"):
        assert (await page.get(path, **{"Sec-Fetch-Site": "cross-site"}))[0] == 403
    page.session.cookie_jar.clear()
    for path in ("/export", "/export/progress", "/export/trc", "/export/like/net"):
        assert (await page.get(path))[0] == 403


async def test_one_runs_at_a_time_and_stops_when_the_page_goes(page, temporary, monkeypatch):
    reached, go_on = asyncio.Event(), threading.Event()
    loop = asyncio.get_running_loop()

    def slow(motion, options, paths, tick):
        while not go_on.wait(0.01):
            tick()
            loop.call_soon_threadsafe(reached.set)

    one = formats.FORMATS["coco"]
    monkeypatch.setitem(formats.FORMATS.own, "coco", ExportFormat("coco", one.title, one.suffixes, slow))
    try:
        first = asyncio.create_task(page.session.get("/export/coco"))
        await asyncio.wait_for(reached.wait(), 20)
        status, text = await page.get("/export/csv")
        assert (status, "Another export is in progress" in text) == (409, True)
        first.cancel()
        async with asyncio.timeout(20):
            while list(temporary.iterdir()):
                await asyncio.sleep(0.02)
        assert (await page.get("/export/csv"))[0] == 200
    finally:
        go_on.set()
