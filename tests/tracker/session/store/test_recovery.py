"""A store that a program left in the middle of a commit is read as it was before that commit."""

import os
import shutil
import sqlite3
import tempfile
from contextlib import closing
from pathlib import Path

import pytest
from crashes import crashed_in_a_commit
from damage import written_store

from tracker.errors import DamagedStoreError, SessionError
from tracker.session.lock import LOCK_FILE, SessionLock
from tracker.session.store import backups
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture
def path(tmp_path):
    """A store with a hot journal."""
    path = tmp_path / "session" / "annotations.sqlite"
    path.parent.mkdir()
    written_store(path)
    path.parent.joinpath("whole.sqlite").write_bytes(path.read_bytes())
    crashed_in_a_commit(path)
    return path


def labels(path):
    with AnnotationStore(path, read_only=True) as store:
        return [entry.label for entry in store.history()]


def journal(path):
    return path.with_name(path.name + "-journal")


def unwritable(folder, monkeypatch):
    """Make SQLite and the lock find a folder that cannot be written, which holds for every account."""

    def refused(self):
        raise SessionError(f"cannot write {self._path}: Read-only file system; open the session where you may write")

    monkeypatch.setattr(SessionLock, "acquire", refused)
    return [(p.name, p.read_bytes()) for p in sorted(folder.iterdir())]


def test_it_is_rolled_back_and_the_lock_released(path):
    assert labels(path) == labels(path.with_name("whole.sqlite"))
    assert not journal(path).exists()
    assert not (path.parent / LOCK_FILE).exists()
    assert path.read_bytes() == path.with_name("whole.sqlite").read_bytes()


def test_it_is_rolled_back_under_the_lock_that_the_program_holds(path):
    with SessionLock(path.parent):
        assert labels(path) == labels(path.with_name("whole.sqlite"))
        assert (path.parent / LOCK_FILE).exists()


@pytest.mark.slow
@pytest.mark.parametrize("why", ["read only", "held"])
def test_a_copy_is_rolled_back_where_the_folder_may_not_be_written(path, why, monkeypatch, tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    if why == "held":
        SessionLock(path.parent).acquire()
        monkeypatch.setattr(backups, "is_held_here", lambda _: False)  # as if another program held it
    before = unwritable(path.parent, monkeypatch)
    assert labels(path) == labels(path.with_name("whole.sqlite"))
    assert [(p.name, p.read_bytes()) for p in sorted(path.parent.iterdir())] == before
    assert list(temporary.iterdir()) == []


def test_a_copy_that_another_program_changes_meanwhile_is_made_again(path, monkeypatch):
    unwritable(path.parent, monkeypatch)
    real, n = shutil.copyfile, []

    def copied(source, to):
        n.append(source)
        if len(n) == 1:
            os.utime(path)
        return real(source, to)

    monkeypatch.setattr(backups.shutil, "copyfile", copied)
    assert labels(path) == labels(path.with_name("whole.sqlite"))
    assert len(n) == 4  # store and journal, twice


def test_going_back_works_beside_a_hot_journal(path):
    (path.parent / "backups").mkdir()
    shutil.copy(path.with_name("whole.sqlite"), path.parent / "backups" / "annotations-20260101T000000000Z.sqlite")
    restored = backups.restore(path)
    assert journal(restored.kept).exists()
    assert labels(path) == labels(path.with_name("whole.sqlite"))


@pytest.mark.slow
@pytest.mark.parametrize("read_only", [True, False])
def test_a_journal_that_leads_to_another_file_is_refused(path, read_only, tmp_path):
    """SQLite deletes the file that such a journal names."""
    named = os.fsencode(tmp_path / "mine.txt")
    (tmp_path / "mine.txt").write_text("mine")
    tail = len(named).to_bytes(4, "big") + (sum(named) & 0xFFFFFFFF).to_bytes(4, "big") + backups._MAGIC
    with journal(path).open("ab") as file:
        file.write((2**30 // 4096 + 1).to_bytes(4, "big") + named + tail)
    with pytest.raises(DamagedStoreError, match="leads to another file; delete the journal"):
        AnnotationStore(path, read_only=read_only)
    assert (tmp_path / "mine.txt").exists()


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["", "-journal", "-wal"])
@pytest.mark.parametrize("read_only", [True, False])
def test_a_named_pipe_beside_the_store_does_not_hang_the_program(tmp_path, ending, read_only):
    path = tmp_path / "annotations.sqlite"
    written_store(path)
    pipe = Path(f"{path}{ending}")
    pipe.unlink(missing_ok=True)
    os.mkfifo(pipe)
    with pytest.raises(SessionError, match="expected a regular file, found a named pipe"):
        AnnotationStore(path, read_only=read_only)


def test_a_store_in_another_journal_mode_is_read(tmp_path):
    path = tmp_path / "annotations.sqlite"
    written_store(path)
    with closing(sqlite3.connect(path)) as db:
        db.execute("PRAGMA journal_mode = WAL")
    assert "mark" in labels(path)
