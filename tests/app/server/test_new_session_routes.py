"""What the form of a new session asks for: folders, small pictures, a survey of the files, exchanged cameras."""

import asyncio
import json
import os
import shutil
import time

import cv2
import numpy as np
import pytest
from drawn_boards import arc, carried, filmed_folders
from unreadable_folders import refuse_folders

from tracker.calibration.boards import footage_calibration
from tracker.calibration.boards.board_description import Board
from tracker.formats.anipose import read_calibration
from tracker.session.session import load_session

BOARD = {"kind": "charuco", "columns": 4, "rows": 5, "square_mm": 100, "dictionary": "DICT_4X4_50"}


@pytest.fixture
def form(folders, tmp_path):
    walk = folders[0]
    return {
        "folder": str(tmp_path / "new"), "calibration": str(walk / "calibration.toml"), "footage": str(walk),
        "people": ["ann"],
    }  # fmt: skip


async def test_a_folder_is_listed_without_what_cannot_be_read(folders, serve):
    walk = folders[0]
    os.mkfifo(walk / "pipe.mp4")
    (walk / "gone.mp4").symlink_to(walk / "nothing.mp4")
    (walk / ".hidden.mp4").touch()
    client = await serve()
    report = json.loads((await client.get(f"/sessions/folder?path={walk}/../walk/"))[1])
    assert (report["folder"], report["parent"], report["is_cut_off"]) == (str(walk), str(walk.parent), False)
    kinds = {e["name"]: e["kind"] for e in report["entries"]}
    assert kinds["FRONT.mp4"] == "video"
    assert kinds["calibration.toml"] == "file"
    assert next(iter(kinds)) == "background"  # folders first
    assert not {"pipe.mp4", "gone.mp4", ".hidden.mp4"} & kinds.keys()
    above = json.loads((await client.get(f"/sessions/folder?path={walk}/FRONT.mp4"))[1])
    assert above["entries"] == report["entries"]
    sessions = json.loads((await client.get(f"/sessions/folder?path={walk.parent}"))[1])["entries"]
    assert "session" in {e["kind"] for e in sessions}
    for text in ("relative", "%00", f"{walk}/nothing/x", "~nobody-of-this-name"):
        status, why = await client.get(f"/sessions/folder?path={text}")
        assert (status, why.startswith("expected")) == (400, True), why
    public = await serve(why="no")
    for path in ("/sessions/folder?path=/", f"/sessions/preview?path={walk}/FRONT.mp4", "/sessions/models"):
        assert (await public.get(path))[0] == 403


async def test_footage_has_a_small_picture_and_nothing_else_has(folders, serve):
    walk = folders[0]
    client = await serve()
    images = walk / "images"
    images.mkdir()
    cv2.imwrite(str(images / "0.png"), np.full((900, 1200, 3), 200, np.uint8))
    os.mkfifo(walk / "pipe.mp4")
    async with client.session.get(f"/sessions/preview?path={walk}/FRONT.mp4") as response:
        assert (response.status, response.content_type) == (200, "image/jpeg")
        assert max(cv2.imdecode(np.frombuffer(await response.read(), np.uint8), 1).shape) == 320
    async with client.session.get(f"/sessions/preview?path={images}") as response:
        assert cv2.imdecode(np.frombuffer(await response.read(), np.uint8), 1).shape == (240, 320, 3)
    for path in ("calibration.toml", "pipe.mp4", "none.mp4", "models"):
        status, why = await client.get(f"/sessions/preview?path={walk}/{path}")
        assert (status, len(why) > 20) == (404, True), path


async def test_a_survey_says_how_cameras_stand_and_which_have_footage(folders, serve, form):
    client, walk = await serve(), folders[0]
    (walk / "LEFT.mp4").rename(walk / "gopro7.mp4")
    chosen = {"calibration": form["calibration"], "footage": form["footage"], "up": "z", "units": None}
    status, text = await client.open(chosen, "/sessions/survey")
    report = json.loads(text)
    assert (status, report["cameras"]) == (200, ["FRONT", "RIGHT", "BACK", "LEFT"])
    assert report["assigned"] == {n: str(walk / f"{n}.mp4") for n in ("FRONT", "RIGHT", "BACK")}
    assert "gopro7.mp4" in {f["name"] for f in report["footage"]}
    assert np.shape(report["rig"]["centers"]) == np.shape(report["rig"]["axes"]) == (4, 3)
    assert len(report["rig"]["heights_m"]) == 4
    assert report["rig"]["sentence"].startswith("The cameras stand")
    assert report["problems"] == []
    report = json.loads(
        (await client.open(chosen | {"calibration": str(walk / "session.toml")}, "/sessions/survey"))[1]
    )
    assert (report["cameras"], report["rig"], len(report["problems"])) == ([], None, 1)
    assert len(report["footage"]) >= 4
    assert json.loads((await client.open({}, "/sessions/survey"))[1])["problems"] == []
    status, text = await client.open({"up": "q"}, "/sessions/survey")
    assert status == 400


async def test_a_folder_inside_the_footage_that_cannot_be_read_is_a_problem(serve, form, tmp_path, monkeypatch):
    (tmp_path / "footage" / "private").mkdir(parents=True)
    client = await serve()
    refuse_folders(monkeypatch, "private")
    status, text = await client.open({"footage": str(tmp_path / "footage"), "up": "z"}, "/sessions/survey")
    assert (status, "private cannot be (Permission denied)" in text) == (200, True), text


async def test_footage_is_given_to_cameras_by_hand(folders, serve, form):
    client, walk = await serve(), folders[0]
    (walk / "LEFT.mp4").rename(walk / "gopro7.mp4")
    cameras = [{"name": n, "footage": str(walk / f)} for n, f in (("FRONT", "FRONT.mp4"), ("LEFT", "gopro7.mp4"))]
    cameras[1]["offset"] = 2
    lines = await client.make(form | {"cameras": cameras, "models": ["gavrila22"]})
    assert "made" in lines[-1], lines
    made = load_session(form["folder"])
    assert [(c.camera.name, c.footage.name, c.offset) for c in made.cameras] == [
        ("FRONT", "FRONT.mp4", 0), ("LEFT", "gopro7.mp4", 2),
    ]  # fmt: skip
    assert made.people[0].model.name == "gavrila22"
    (line,) = await client.make(form | {"models": ["a", "b"]})
    assert "one body model for all" in line["failed"]


async def test_an_offset_of_0_is_given_on_purpose(folders, serve, form):
    """Names of pictures that do not show the instant are paired in their order by it, without it they are refused."""
    client, walk = await serve(), folders[0]
    cameras = []
    for name, words in (("FRONT", ("a", "b")), ("LEFT", ("1000", "2000"))):
        image = cv2.VideoCapture(str(walk / f"{name}.mp4")).read()[1]
        (walk / f"{name}_pictures").mkdir()
        for word in words:
            cv2.imwrite(str(walk / f"{name}_pictures" / f"{word}.png"), image)
        cameras.append({"name": name, "footage": str(walk / f"{name}_pictures"), "offset": None})
    (*_, line) = await client.make(form | {"cameras": cameras, "fps": 30})
    assert "give an offset of 0 to pair them in their order" in line["failed"], line
    cameras[1]["offset"] = 0
    lines = await client.make(form | {"cameras": cameras, "fps": 30})
    assert "made" in lines[-1], lines


async def test_a_calibration_by_a_board_fails_before_footage_is_read(folders, serve):
    client, walk = await serve(), folders[0]
    form = {"footage": str(walk), "board": BOARD, "out": str(walk / "new.toml")}
    for change, why in (
        ({"out": str(walk / "calibration.toml")}, "not to exist, found a file; choose another file"),
        ({"out": str(walk / "none" / "a.toml")}, "in a folder that exists, found none"),
        ({"out": str(walk / f"{'a' * 250}.toml")}, "cannot write"),
        ({"out": str(walk / "none" / "a.toml"), "footage": str(walk / "none")}, "expected a folder of videos"),
        ({"footage": str(walk / "models")}, "expected videos"),
        ({"board": str(walk / "gone.toml")}, "gone.toml"),
        ({"board": BOARD | {"square_mm": 0.1}}, "use the command line if it is right"),
        ({"board": {k: v for k, v in BOARD.items() if k != "dictionary"}}, "expected the set of markers"),
        ({"fisheye": ["eve"]}, "expected a fisheye lens for one of"),
        ({"out": "relative.toml"}, "expected a path from the root"),
    ):
        status, text = await client.open(form | change, "/sessions/calibrate")
        assert (status, why in json.loads(text)["failed"]) == (200, True), text
    assert (await client.open(form | {"board": 3}, "/sessions/calibrate"))[0] == 400
    assert (await (await serve(why="no")).open(form, "/sessions/calibrate"))[0] == 403
    assert not (walk / "new.toml").exists()


async def test_a_page_that_is_gone_ends_a_calibration(folders, serve, monkeypatch):
    client, walk, ended = await serve(), folders[0], []

    def calibrate(_, report):
        try:
            for _ in range(1000):  # not for ever, so that the test ends if the work does not
                report("corners", 0.5)
                time.sleep(0.01)
        except ConnectionResetError as error:
            ended.append(error)
            raise

    monkeypatch.setattr(footage_calibration, "calibrate_footage", calibrate)
    form = {"footage": str(walk), "board": BOARD, "out": str(walk / "new.toml")}
    origin = {"Origin": client.origin}
    async with client.session.post("/sessions/calibrate", json=form, headers=origin) as response:
        line = json.loads(await response.content.readline())
        assert line["progress"]["text"].startswith("Corners: 50%")
        assert (await client.open(form, "/sessions/calibrate"))[0] == 409
        response.close()
    async with asyncio.timeout(20):
        while not ended:
            await asyncio.sleep(0.01)
    assert not (walk / "new.toml").exists()


@pytest.mark.slow
async def test_a_calibration_by_a_board_is_written_beside_its_footage(serve, tmp_path):
    board, client = Board("charuco", 4, 5, 0.1), await serve()
    filmed_folders(tmp_path / "board", board, arc(), carried(board, 13))
    out = tmp_path / "board" / "calibration.toml"
    form = {"footage": str(tmp_path / "board"), "board": BOARD, "out": str(out)}
    status, text = await client.open(form, "/sessions/calibrate")
    *progress, last = [json.loads(line) for line in text.splitlines()]
    assert all(one["progress"]["share"] <= 1 for one in progress)
    found = last["calibrated"]
    assert (status, found["out"], found["up"]) == (200, str(out), "-y")
    assert "with 90% between" in found["sentence"]
    names = [camera.name for camera in read_calibration(out)]
    assert [(c["name"], c["footage"]) for c in found["cameras"]] == [(n, str(tmp_path / "board" / n)) for n in names]
    for camera in found["cameras"]:
        assert 5 <= camera["views"] <= 13
        assert 0.01 < camera["covered_share"] < 0.6
        assert camera["held_out_px"] < 0.5
        assert len(camera["corners"]) > 2 * 12 * 5 > len(camera["gross"])
        assert 0 <= min(camera["corners"]) <= max(camera["corners"]) <= 640


@pytest.mark.slow
async def test_frames_that_only_some_cameras_have_are_left_out_by_choice(folders, serve, form):
    client, walk = await serve(), folders[0]
    n_frames, images = load_session(walk).n_frames, cv2.VideoCapture(str(walk / "LEFT.mp4"))
    shape = [int(images.get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
    shorter = cv2.VideoWriter(str(walk / "short.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 30, shape)
    for _ in range(n_frames - 2):
        shorter.write(images.read()[1])
    shorter.release()
    cameras = [{"name": n, "footage": str(walk / f)} for n, f in (("FRONT", "FRONT.mp4"), ("LEFT", "short.mp4"))]
    (*_, line) = await client.make(form | {"cameras": cameras, "fps": 30})
    assert f"choose Common frames to take the {n_frames - 2} that all have" in line["failed"]
    lines = await client.make(form | {"cameras": cameras, "fps": 30, "common_frames": True})
    assert "made" in lines[-1], lines
    assert load_session(form["folder"]).n_frames == n_frames - 2


@pytest.mark.slow
async def test_nothing_is_made_while_two_cameras_seem_exchanged(serve, form, tmp_path, data_folder):
    walk = data_folder("walk")
    mixed = tmp_path / "mixed"
    shutil.copytree(walk, mixed)
    videos = {p.stem: p for p in mixed.glob("*.mp4")}
    a, b = sorted(videos)[:2]
    videos[a].rename(mixed / "x.mp4")
    videos[b].rename(videos[a])
    (mixed / "x.mp4").rename(videos[b])
    form |= {"calibration": str(mixed / "Calib.toml"), "footage": str(mixed)}
    client = await serve()
    lines = await client.make(form)
    assert set(lines[-1]["exchanged"]["cameras"]) == {a, b}, lines
    assert "seems to be exchanged" in lines[-1]["exchanged"]["text"]
    assert not (tmp_path / "new").exists()
    right = {n: str(p) for n, p in videos.items()} | {a: str(videos[b]), b: str(videos[a])}
    lines = await client.make(form | {"cameras": [{"name": n, "footage": p} for n, p in sorted(right.items())]})
    assert [*lines[-1], lines[-2]] == ["made", {"passed": "No two cameras seem to be exchanged."}]
    lines = await client.make(form | {"folder": str(tmp_path / "kept"), "keep_assignment": True})
    assert [next(iter(line)) for line in lines[-2:]] == ["warning", "made"]


@pytest.mark.slow
async def test_a_calibration_of_a_file_for_each_camera_is_given_by_these_files(folders, serve, form):
    client, walk = await serve(), folders[0]
    (walk / "LEFT.mp4").unlink()
    cameras = [source.camera for source in load_session(walk).cameras[:3]]
    for camera in cameras:
        T = np.linalg.inv(camera.T_world_camera)
        stated = {"K": camera.K.tolist(), "R": T[:3, :3].tolist(), "t": T[:3, 3].tolist(), "size": list(camera.size)}
        for name in (f"cam {camera.name}.json", f"cam;{camera.name}.json"):
            (walk / name).write_text(json.dumps({camera.name: stated}))
    files = [f"cam {camera.name}.json" for camera in cameras]
    for text in (f"{walk}/{'; '.join(files)}", f"{';'.join(f' {walk}/{name} ' for name in files)};"):
        report = json.loads((await client.open({"calibration": text}, "/sessions/survey"))[1])
        assert (report["cameras"], report["problems"]) == (["FRONT", "RIGHT", "BACK"], [])
    alone = json.loads((await client.open({"calibration": f"{walk}/cam;RIGHT.json"}, "/sessions/survey"))[1])
    assert alone["cameras"] == ["RIGHT"]  # a name with a semicolon
    lines = await client.make(form | {"calibration": f"{walk}/{'; '.join(files)}"})
    assert "made" in lines[-1], lines
    assert [c.camera.name for c in load_session(form["folder"]).cameras] == ["FRONT", "RIGHT", "BACK"]
    a_path = "expected a path from the root or from ~"
    for text, why in (
        (f"{walk}/{files[0]}; gone", f"{walk}/gone not found"),
        (f"{walk}/a; ./b", a_path),
        (";", a_path),
    ):
        (line,) = await client.make(form | {"calibration": text, "folder": form["folder"] + "2"})
        assert why in line["failed"]


@pytest.mark.slow
async def test_poses_of_another_convention_are_named_as_a_choice_of_the_form(folders, serve, form):
    """A file that does not state the size of its pictures is surveyed too."""
    client, entries = await serve(), {}
    for camera in load_session(folders[0]).cameras:
        T, K = camera.camera.T_world_camera, camera.camera.K
        entries[camera.camera.name] = {"K": K.tolist(), "R": T[:3, :3].tolist(), "t": T[:3, 3].tolist()}
    (folders[0] / "inverse.json").write_text(json.dumps(entries))
    chosen = {"calibration": str(folders[0] / "inverse.json"), "footage": form["footage"]}
    report = json.loads((await client.open(chosen, "/sessions/survey"))[1])
    assert (report["rig"], "choose camera-to-world as Poses" in report["problems"][0]) == (None, True), report
    report = json.loads((await client.open(chosen | {"poses": "camera-to-world"}, "/sessions/survey"))[1])
    right = json.loads((await client.open({"calibration": form["calibration"]}, "/sessions/survey"))[1])
    assert report["problems"] == []
    np.testing.assert_allclose(report["rig"]["distances_m"], right["rig"]["distances_m"], atol=2e-3)
    lines = await client.make(form | chosen | {"poses": "camera-to-world"})
    assert "made" in lines[-1], lines
