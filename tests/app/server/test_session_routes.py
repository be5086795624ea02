"""Other sessions, listed and opened by a page."""

import json

import pytest

from app.runtime import restart
from app.server.session_routes import refusal
from app.session.recent_sessions import TABLE_FILE, recent_sessions, remember, remember_batch
from tracker.session.lock import SessionLock
from tracker.session.session import load_session


async def test_recent_sessions_are_listed_and_one_is_opened(folders, serve):
    walk, dance, state = folders
    for folder in (dance, walk, folders[0].parent / "gone"):
        remember(state, folder)
    client = await serve()
    started = json.loads((await client.get("/starting.json"))[1])
    assert started == {"steps": [], "at": 0, "folder": str(walk)}
    listed = json.loads((await client.get("/sessions"))[1])
    assert listed["folder"] == str(walk)
    assert [(r["folder"], r["name"]) for r in listed["recent"]] == [
        (str(dance), "dance")
    ]  # neither this one nor a lost one
    assert json.loads((await client.open({"folder": str(dance)}))[1]) == {"name": "dance"}
    assert client.routes.chosen == (dance, 0, "")
    assert client.routes.is_chosen.is_set()


async def test_the_last_batches_are_listed_and_a_recording_is_opened_at_a_frame(folders, serve, tmp_path):
    _, dance, state = folders
    for name, text in {"a": '{"totals": {}, "recordings": []}', "broken": "{", "odd": "[1]"}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / TABLE_FILE).write_text(text)
        remember_batch(state, tmp_path / name)
    client = await serve()
    listed = json.loads((await client.get("/sessions"))[1])
    assert listed["batches"] == [{"name": "a", "totals": {}, "recordings": []}]
    assert [r["name"] for r in listed["recent"]] == []
    person = load_session(dance).people[0].name
    for body, expected in (({"frame": 10**6}, "expected a frame from 0"), ({"person": "eve"}, "expected a person")):
        status, text = await client.open({"folder": str(dance)} | body)
        assert (status, expected in text) == (400, True)
    assert (await client.open({"folder": str(dance), "frame": 1, "person": person}))[0] == 200
    assert client.routes.chosen == (dance, 1, person)


async def test_a_folder_that_is_no_session_is_refused(folders, serve, tmp_path):
    walk, dance, _ = folders
    client = await serve()
    (tmp_path / "empty").mkdir()
    for folder, expected in {
        str(walk): "expected another session",
        str(tmp_path / "empty"): "is not a session",
        "dance": "expected a path from the root",
        "../dance": "expected a path from the root",
        f"{dance}\0": "expected a path",
        "~nobody-of-this-name/x": "expected a user",
    }.items():
        status, text = await client.open({"folder": folder})
        assert (status, expected in text) == (400, True), text
    with SessionLock(dance):
        status, text = await client.open({"folder": str(dance)})
    assert (status, "open" in text) == (400, True)
    for body in (b"{", b"[]", b'{"folder": 3}', b'{"folder": "/x", "more": 1}', b"\xff"):
        assert (await client.open(body))[0] == 400
    assert client.routes.chosen is None
    (dance / "FRONT.mp4").unlink()
    assert (await client.open({"folder": str(dance)}))[0] == 400


async def test_unsaved_edits_keep_the_session_open(folders, serve):
    client = await serve(unsaved="the disk is full")
    status, text = await client.open({"folder": str(folders[1])})
    assert (status, "the disk is full" in text) == (400, True)
    assert client.routes.chosen is None


async def test_foreign_requests_and_public_pages_open_nothing(folders, serve):
    client = await serve()
    body = {"folder": str(folders[1])}
    assert (await client.open(body, Origin="http://evil.example"))[0] == 403
    assert (await client.open(body, **{"Content-Type": "text/plain"}))[0] == 403
    assert (await client.open(body, **{"Sec-Fetch-Site": "cross-site"}))[0] == 403
    public = await serve(why=refusal(False, True))
    remember(folders[2], folders[1])
    status, text = await public.open(body)
    assert (status, "on the command line" in text) == (403, True)
    assert (await public.get("/sessions/paths?text=/"))[0] == 403
    listed = json.loads((await public.get("/sessions"))[1])
    assert (listed["recent"], listed["folder"], listed["refusal"]) == ([], "", text)
    assert refusal(True, True) is None
    assert "without a token" in refusal(True, False)


async def test_paths_are_completed(folders, serve):
    client = await serve()
    parent = folders[0].parent
    report = json.loads((await client.get(f"/sessions/paths?text={parent}/"))[1])
    assert [(one["path"], one["is_session"]) for one in report] == [
        (f"{parent}/dance/", True),
        (f"{parent}/walk/", True),
    ]
    report = json.loads((await client.get(f"/sessions/paths?text={parent}/WA"))[1])
    assert [one["path"] for one in report] == [f"{parent}/walk/"]
    for text in ("relative", "", f"{parent}/nothing/x", "%00"):
        assert json.loads((await client.get(f"/sessions/paths?text={text}"))[1]) == []


def test_a_damaged_list_is_empty_and_written_again(folders):
    walk, _, state = folders
    state.mkdir()
    (state / "recent_sessions.json").write_text('[{"folder": 3}]')
    assert recent_sessions(state) == []
    for _ in range(2):
        remember(state, walk)
    assert [s.folder for s in recent_sessions(state)] == [walk]
    assert (state / "recent_sessions.json").stat().st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("original", "program"),
    [
        (["python", "-m", "quadrille", "open", "x"], ["-m", "quadrille"]),
        (["python3", "/bin/quadrille", "open", "x"], ["/bin/quadrille"]),
    ],
)
def test_a_restart_keeps_the_way_in_which_the_program_was_started(monkeypatch, original, program):
    called = []
    monkeypatch.setattr(restart.os, "execv", lambda path, words: called.append((path, words)))
    monkeypatch.setattr(restart.sys, "orig_argv", original)
    monkeypatch.setattr(restart.sys, "argv", ["app", "open", "x"])
    restart.restart(["open", "/data/dance"])
    executable = restart.sys.executable
    assert called == [(executable, [executable, *program, "open", "/data/dance"])]


@pytest.mark.slow
async def test_a_session_is_made_with_its_checks_told_one_by_one(folders, serve, tmp_path):
    walk = folders[0]
    client = await serve()
    form = {
        "folder": str(tmp_path / "new"), "calibration": str(walk / "calibration.toml"), "footage": str(walk),
        "people": ["ann", "bob"], "heights": [170, 1.6],
    }  # fmt: skip
    lines = await client.make(form)
    assert [next(iter(line)) for line in lines] == ["passed"] * 7 + ["made"]
    assert "4 cameras: FRONT" in lines[0]["passed"]
    assert "50 frames at 25" in lines[3]["passed"]
    assert "ann 1.70 m, bob 1.60 m" in lines[4]["passed"]
    assert lines[-1]["made"] == str(tmp_path / "new")
    made = load_session(tmp_path / "new")
    assert [p.name for p in made.people] == ["ann", "bob"]
    # A second one in the same place: checks pass, and what fails is a sentence.
    lines = await client.make(form)
    assert "exists already" in lines[-1]["failed"]
    for wrong, expected in (
        ({"footage": str(tmp_path / "state")}, "expected a folder of videos"),
        ({"heights": [170, 160, 150]}, "one for each of 2 people, found 3"),
        ({"heights": [9], "folder": str(tmp_path / "other")}, "a person of 0.6 to 2.3 metres, found 9"),
        ({"footage": "relative"}, "expected a path from the root"),
        ({"calibration": str(walk / "session.toml"), "folder": str(tmp_path / "other")}, "calibration"),
    ):
        *_, line = await client.make(form | wrong)
        assert expected in line["failed"]
    assert not (tmp_path / "other").exists()
    public = await serve(why="no")
    assert (await public.open(form, "/sessions/new"))[0] == 403
