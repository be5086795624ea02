"""Sessions from elsewhere: pipes in the place of files do not hang a command, and a trigger does not run."""

import os

import pytest
from command_line import SAMPLE, WITH_POSE, assert_refused
from damage import altered


def replaced_by_a_pipe(path):
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    os.mkfifo(path)


@pytest.fixture
def placed(run, session):
    assert run("init", session, *WITH_POSE, "--frame", "3")[0] == 0
    return session


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("session.toml", "is not a session"),
        (
            "calibration.toml",
            "found 'calibration.toml', where the system says: expected a regular file, found a named pipe",
        ),
        (
            "models/person.toml",
            "found 'models/person.toml', where the system says: expected a regular file, found a named pipe",
        ),
        ("annotations.sqlite", "are damaged: expected a regular file, found a named pipe"),
        ("annotations.sqlite-journal", "are damaged: expected a regular file, found a named pipe"),
    ],
)
def test_named_pipes_do_not_hang_a_command_that_reads(run, placed, name, expected):
    replaced_by_a_pipe(placed / name)
    assert_refused(run("info", placed, "--no-check"), [expected])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lock.json", "annotations.sqlite-journal", "backups/annotations-20260101T0Z.sqlite"])
def test_named_pipes_do_not_hang_a_command_that_writes(run, placed, name):
    replaced_by_a_pipe(placed / name)
    status, _, err = run("init", placed, *WITH_POSE, "--frame", "5")
    assert (status, "Traceback" in err) == (int("backups" not in name), False)


@pytest.mark.parametrize(
    "kind",
    ["footage", pytest.param("background", marks=pytest.mark.slow), pytest.param("masks", marks=pytest.mark.slow)],
)
def test_named_pipes_in_place_of_footage(run, session, kind):
    os.mkfifo(session / "pipe")
    text = (session / "session.toml").read_text("utf-8")
    old = text.splitlines()[next(i for i, line in enumerate(text.splitlines()) if "footage" in line)]
    new = old.replace("{ name", f'{{ {kind} = "pipe", name') if kind != "footage" else None
    if new is None or kind in old:
        key = old.index(f"{kind} = ") + len(f"{kind} = ")
        new = old[:key] + '"pipe"' + old[old.index('"', key + 1) + 1 :]
    (session / "session.toml").write_text(text.replace(old, new), "utf-8")
    assert_refused(run("info", session), ["'pipe'", "expected a regular file, found a named pipe"])


def test_a_trigger_in_a_store_by_mail_does_not_run(run, placed):
    trigger = "CREATE TRIGGER gone AFTER INSERT ON poses BEGIN DELETE FROM poses; END"
    altered(placed / "annotations.sqlite", trigger)
    before = (placed / "annotations.sqlite").read_bytes()
    for words in (["info", "--no-check"], ["init", "--joints", SAMPLE / "truth.trc", "--frame", "5"]):
        assert_refused(run(words[0], placed, *words[1:]), ["the trigger 'gone' is none of the program"])
    assert (placed / "annotations.sqlite").read_bytes() == before
