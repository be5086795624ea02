"""`quadrille restore` from end to end."""

import json
import sqlite3
from contextlib import closing

import pytest
from command_line import SAMPLE, WITH_POSE, assert_refused, stored
from crashes import crashed_in_a_commit
from damage import altered

from tracker.session.lock import SessionLock


@pytest.fixture
def edited(run, session):
    """A session with poses of two frames, of which a backup has one."""
    for frame in ("3", "5"):
        assert run("init", session, *WITH_POSE, "--frame", frame)[0] == 0
    return session


def damage(session):
    altered(session / "annotations.sqlite", "UPDATE pose_changes SET frame = frame + 1")


def test_a_damaged_store_goes_back_to_its_backup(run, edited):
    damage(edited)
    refused = run("info", edited)
    assert_refused(refused, ["annotations.sqlite are damaged", "person, frame 4", f"run 'quadrille restore {edited}'"])
    status, out, _ = run("restore", edited, "--json")
    report = json.loads(out)
    assert status == 0
    assert "frame 4" in report["damage"]
    assert report["backup"] in report["backups"]
    assert list(stored(edited)) == [3]
    with closing(sqlite3.connect(report["kept"])) as db:
        assert db.execute("SELECT frame FROM poses ORDER BY frame").fetchall() == [(3,), (5,)]
        assert db.execute("SELECT frame FROM pose_changes ORDER BY frame").fetchall() == [(4,), (6,)]


@pytest.mark.slow
def test_a_sound_store_stays_as_it_is_unless_a_backup_is_named(run, edited):
    before = (edited / "annotations.sqlite").read_bytes()
    status, out, _ = run("restore", edited)
    assert (status, "nothing to restore" in out, "backups, newest first: annotations-" in out) == (0, True, True)
    assert (edited / "annotations.sqlite").read_bytes() == before
    (backup,) = (edited / "backups").iterdir()
    status, out, _ = run("restore", edited, "--backup", backup.name)
    assert (status, list(stored(edited))) == (0, [3])
    assert "the file that it replaces is kept as" in out


@pytest.mark.slow
def test_an_impossible_restore_is_refused(run, edited, tmp_path):
    assert_refused(run("restore", tmp_path), ["is not a session"])
    assert_refused(run("restore", edited, "--backup", "other.sqlite"), ["expected a backup", "other.sqlite", "no such"])
    with SessionLock(edited):
        assert_refused(run("restore", edited), ["is open already"])
    next((edited / "backups").iterdir()).unlink()
    damage(edited)
    assert_refused(run("restore", edited), ["found none; put a copy of the file in its place"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["info", "--no-check"],
        ["export", "--out", "out.csv"],
        ["evaluate", "--reference", SAMPLE / "truth.trc"],
        ["observability", "--frame", "3"],
        ["restore"],
    ],
    ids=lambda words: words[0],
)
def test_every_command_reads_what_a_crash_in_a_commit_left(run, edited, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    crashed_in_a_commit(edited / "annotations.sqlite")
    status, _, err = run(words[0], edited, *words[1:])
    assert (status, "quadrille:" in err) == (0, False), err
    assert not (edited / "lock.json").exists()
    assert list(stored(edited)) == [3, 5]
