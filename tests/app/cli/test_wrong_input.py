"""What wrong input gets at the command line: one sentence, status 1, and nothing half-written."""

import json
import shutil
import socket
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from command_line import SAMPLE, WITH_POSE, assert_refused, stored

from tracker.evidence.camera_exchange import CameraExchange
from tracker.footage.video_writer import VideoWriter
from tracker.formats.anipose import write_calibration
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.session.lock import SessionLock

SIZE = (64, 48)


@pytest.fixture(scope="module")
def footage(tmp_path_factory):
    """Two cameras' small videos of six frames, and their calibration."""
    folder = tmp_path_factory.mktemp("footage")
    K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
    turns = [rigid.so3_exp(np.array([0.0, 0.01 * i, 0.0])) for i in range(2)]
    poses = [rigid.transform(turn, np.array([float(i), 0.5, 1.0])) for i, turn in enumerate(turns)]
    names = ("front", "left")
    write_calibration(
        folder / "Calib.toml", [Camera(n, SIZE, K, np.zeros(0), T) for n, T in zip(names, poses, strict=True)]
    )
    for name in names:
        film(folder / f"{name}.mp4")
    return folder


def film(path, n=6, size=SIZE, fps=25.0):
    rng = np.random.default_rng(0)
    with VideoWriter(path, size, fps) as writer:
        for _ in range(n):
            writer.write(rng.integers(0, 255, (size[1], size[0], 3), dtype=np.uint8))


@pytest.fixture
def room(footage, tmp_path):
    """The small footage in a folder of its own, to be spoilt."""
    return Path(shutil.copytree(footage, tmp_path / "room"))


def new(room, *more):
    return "new", room / "s", "--calibration", room / "Calib.toml", "--videos", *sorted(room.glob("*.mp4")), *more


def change(path, old, new_text):
    text = path.read_text()
    assert old in text, (old, text)
    path.write_text(text.replace(old, new_text, 1))


def spoilt_video(room):
    (room / "left.mp4").write_bytes(b"no video at all" * 100)


def truncated_video(room):
    data = (room / "left.mp4").read_bytes()
    (room / "left.mp4").write_bytes(data[: len(data) // 2])


def calibrated(**changes):
    """A calibration whose second camera has other values."""

    def spoil(room):
        data = tomllib.loads((room / "Calib.toml").read_text())
        next(section for section in data.values() if section.get("name") == "left").update(changes)
        (room / "Calib.toml").write_text(tomli_w.dumps(data))

    return spoil


SKEWED = [[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 1.0]]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (spoilt_video, ["'left'", "left.mp4"]),
        (truncated_video, ["'left'", "truncated"]),
        (lambda room: film(room / "top.mp4"), ["top.mp4 belongs to no calibrated camera", "front, left"]),
        (lambda room: film(room / "left.mp4", n=9), ["'front' 6, 'left' 9"]),
        (lambda room: film(room / "left.mp4", fps=30.0), ["'front' 25, 'left' 30"]),
        (lambda room: film(room / "left.mp4", size=(32, 24)), ["'left'", "64x48", "32x24"]),
        (calibrated(translation=[float("nan"), 0.0, 1.0]), ["'left'", "finite", "translation"]),
        (calibrated(rotation=SKEWED), ["'left'", "not a rotation"]),
        (calibrated(translation=[1000.0, -500.0, 3000.0]), ["the unit is another", "--units mm (3.2 m)"]),
        (lambda room: (room / "Calib.toml").write_text("[front]\nname = \n"), ["Calib.toml", "line 2"]),
        (lambda room: (room / "Calib.toml").unlink(), ["Calib.toml not found"]),
    ],
)
def test_footage_and_calibrations_that_do_not_fit(run, room, spoil, expected):
    spoil(room)
    before = sorted(room.iterdir())
    assert_refused(run(*new(room)), expected)
    assert sorted(room.iterdir()) == before  # nothing half-written


MODEL = """
version = 1
name = "odd"
parts = [{ name = "trunk", half_axes = [0.1, 0.1, 0.2] }, { name = "arm", half_axes = [0.1, 0.1, 0.2] }]
joints = [{ name = "root", child = "trunk", free = true }, { name = "hinge", parent = "PARENT", child = "arm" }]
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (["--camera", "front"], ["--camera as NAME=VALUE", "'front'"]),
        (["--camera", "front="], ["--camera as NAME=VALUE", "'front='"]),
        (["--cameras", "front", "top"], ["unknown camera 'top'", "front, left"]),
        (["--camera", "top=x.mp4"], ["unknown camera 'top'"]),
        (["--camera", "left=missing.mp4"], ["'left'", "missing.mp4"]),
        (["--offset", "left=one"], ["--offset as NAME=VALUE", "'left=one'"]),
        (["--height", "tall"], ["--height", "'tall'"]),
        (["--height", "17.5"], ["0.6 to 2.3 metres", "--any-size"]),
        (["--height", "nan"], ["0.6 to 2.3 metres", "found nan"]),
        (["--height", "nan", "--any-size"], ["0.3 to 3 metres", "nan"]),
        (["--offset", "left=" + "9" * 30], ["'left'", "an offset below its 6 frames", "check the footage"]),
        (["--fps", "0"], ["a frame rate above 0"]),
        (["--fps", "nan"], ["a frame rate above 0"]),
        (["--model", "ROOM/latin.toml"], ["body model", "latin.toml", "expected UTF-8 text"]),
        (["--model", "ROOM/large.toml"], ["large.toml", "at most 0.5 MB"]),
        (["--people", "a", "a"], ["a name of its own for each person, found more than one 'a'"]),
        (["--background", "nowhere"], ["'front'", "nowhere"]),
        (["--model", "gavrila23"], ["gavrila23", "gavrila22"]),
        (["--model", "ROOM/loop.toml"], ["loop"]),
        (["--model", "ROOM/orphan.toml"], ["missing parent", "'tail'"]),
        (["--units", "mm"], ["1.5 millimetres", "say --units m (1.5 m)"]),
    ],
)
def test_wrong_options(run, room, more, expected):
    (room / "loop.toml").write_text(MODEL.replace("PARENT", "arm"))
    (room / "orphan.toml").write_text(MODEL.replace("PARENT", "tail"))
    (room / "latin.toml").write_bytes(MODEL.replace("odd", "größe").encode("latin-1"))
    (room / "large.toml").write_text(f"a = [{'0,' * 10_000_000}]")
    before = sorted(room.iterdir())
    assert_refused(run(*new(room, *[w.replace("ROOM", str(room)) for w in more])), expected)
    assert sorted(room.iterdir()) == before


def test_a_folder_in_use_is_not_overwritten(run, room):
    assert run(*new(room))[0] == 0
    before = (room / "s" / "session.toml").read_bytes()
    assert_refused(run(*new(room)), ["exists already"])
    assert (room / "s" / "session.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["init", "SESSION", "--joints", "TRUTH", "--frame", "50"], ["0:50", "50"]),
        (["init", "SESSION", "--joints", "TRUTH", "--frame", "-1"], ["0:50"]),
        (["init", "SESSION", "--method", "voxels", "--frames", "2:9"], ["auto or keypoints", "found voxels"]),
        (["track", "SESSION", "--frames", "40:60"], ["0:50", "'40:60'"]),
        (["track", "SESSION", "--frames", "7:7"], ["'7:7'"]),
        (["track", "SESSION", "--frames", "7"], ["'7'"]),
        (["track", "SESSION", "--frames", "a:b"], ["'a:b'"]),
        (["track", "SESSION", "--frames", "0:3"], ["a pose of 'person' at frame 0", "init"]),
        (["track", "SESSION", "--person", "eve"], ["'eve'", "person"]),
        (["evaluate", "SESSION", "--reference", "TRUTH"], ["no poses"]),
        (["evaluate", "SESSION", "--reference", "nowhere.trc"], ["nowhere.trc"]),
        (["init", "SESSION", "--joints", "nowhere.trc"], ["nowhere.trc"]),
        (["info", "nowhere"], ["nowhere is not a session", "quadrille new"]),
        (["open", "nowhere"], ["nowhere is not a session"]),
        (["nowhere"], ["nowhere is not a session"]),
        (["open", "SESSION", "--host", "0.0.0.0"], ["--allow-host"]),
    ],
)
def test_wrong_words_about_a_session(run, session, words, expected):
    filled = [w.replace("SESSION", str(session)).replace("TRUTH", str(SAMPLE / "truth.trc")) for w in words]
    assert_refused(run(*filled), expected)
    assert stored(session) == {} if (session / "annotations.sqlite").exists() else True
    assert not (session / "lock.json").exists()


def test_a_session_by_a_newer_version(run, session):
    change(session / "session.toml", "version = 1", "version = 9")
    for words in (("info",), ("open",), ("track",), ("init", "--joints", SAMPLE / "truth.trc")):
        assert_refused(run(words[0], session, *words[1:]), ["has version 9", "upgrade quadrille"])


def test_a_session_with_a_syntax_error(run, session):
    change(session / "session.toml", "fps = 25.0", "fps = ")
    assert_refused(run("info", session), ["session.toml", "line 3"])


def test_a_session_whose_video_is_gone(run, session):
    run("init", session, *WITH_POSE)
    (session / "BACK.mp4").unlink()
    for words in (("track", session), ("open", session, "--port", "0", "--no-browser")):
        assert_refused(run(*words), ["'BACK'", "BACK.mp4", f"quadrille relink {session} --search FOLDER"])
        assert not (session / "lock.json").exists()
    before = stored(session)
    cameras = json.loads(run("info", session, "--json")[1])["cameras"]
    assert [c["name"] for c in cameras if c["missing"] == ["footage"]] == ["BACK"]
    assert "BACK.mp4, background; missing: footage" in run("info", session)[1]
    assert_refused(run("relink", session), ["'BACK'", "--search FOLDER"])
    status, out, _ = run("relink", session, "--search", session / "models", "--json")
    assert (status, json.loads(out)["relinked"], len(json.loads(out)["missing"])) == (1, [], 1)
    shutil.copy(SAMPLE / "BACK.mp4", session.parent / "moved.mp4")
    assert_refused(run("relink", session, "--camera", "BACK"), ["--camera as NAME=VALUE"])
    assert run("relink", session, "--camera", f"BACK={session.parent / 'moved.mp4'}")[0] == 0
    assert json.loads(run("info", session, "--json")[1])["cameras"][2]["missing"] == []
    assert stored(session)[0].values.tolist() == before[0].values.tolist()


@pytest.mark.slow
def test_a_session_open_already(run, session):
    with SessionLock(session):
        for words in (
            ("track", session),
            ("open", session, "--no-browser"),
            ("init", session, "--joints", SAMPLE / "truth.trc"),
        ):
            assert_refused(run(*words), ["open"])
        assert run("info", session)[0] == 0  # looking is allowed
    assert stored(session) == {} if (session / "annotations.sqlite").exists() else True


def test_exchanged_footage_is_told(run, room, monkeypatch):
    exchange = CameraExchange(("front", "left"), 0.2, 0.9, True)
    monkeypatch.setattr("tracker.evidence.camera_exchange.find_exchange", lambda *_: exchange)
    status, out, err = run(*new(room))
    assert (status, out.splitlines()[0]) == (0, f"made {room / 's'}: 2 cameras, 6 frames at 25 per second")
    err = err.splitlines()[-1]  # after a note on the axis that points up
    assert err.startswith("warning: the footage of 'front' and 'left' seems to be exchanged: ")
    assert "20% of what moves in the views, and 90% with the two exchanged" in err
    assert run("info", room / "s")[1].splitlines()[-1] == err.strip()
    assert json.loads(run("info", room / "s", "--json")[1])["warning"] == exchange.text
    assert "warning" not in run("info", room / "s", "--no-check")[1]


@pytest.mark.slow
def test_a_first_pose_tells_exchanged_footage(run, session, monkeypatch):
    monkeypatch.setattr("tracker.evidence.camera_exchange.find_body_exchange", lambda *_: ("BACK", "LEFT"))
    out = run("init", session, "--joints", SAMPLE / "truth.trc")[1]
    assert "warning: the footage of 'BACK' and 'LEFT' seems to be exchanged: nothing differs" in out


@pytest.mark.slow
def test_a_busy_port(session):
    """In a process of its own, as it comes: nothing but the sentence, and no lock left behind."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        words = [sys.executable, "-m", "quadrille", "open", str(session), "--port", str(port), "--no-browser"]
        done = subprocess.run(words, cwd=SAMPLE.parents[1], capture_output=True, text=True, timeout=120)
    # viser says on standard output that it stopped; what went wrong is said on standard error alone.
    assert_refused((done.returncode, "", done.stderr), [str(port), "--port"])
    assert not (session / "lock.json").exists()


@pytest.mark.slow
def test_a_reader_that_has_read_enough():
    """As `quadrille info S | head -1` where head is gone before the program writes."""
    words = [sys.executable, "-m", "quadrille", "info", str(SAMPLE)]
    program = subprocess.Popen(words, cwd=SAMPLE.parents[1], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    program.stdout.close()
    assert program.stderr.read() == ""
    assert program.wait(timeout=120) == 141


def test_options_that_contradict_the_search_for_people_are_refused(run, session):
    assert_refused(run("track", session, "--acquire"), ["expected a pose of 'person', found none", "--init auto"])
    result = run("track", session, "--acquire", "--backward")
    assert_refused(result, ["expected --acquire without --backward", "both directions"])
    result = run("track", session, "--init", "auto", "--backward")
    assert_refused(result, ["expected --init without --backward", "both directions"])
