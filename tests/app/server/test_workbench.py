"""What becomes of edits that cannot be written when the program ends, and of a folder that goes away."""

import shutil
import signal
import sqlite3
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import SAMPLE, stored
from gestures import drag, wait_for
from page_visits import visiting

from app.control.session import save_retry
from app.runtime.kernel_compiler import KernelCompiler
from app.server import workbench
from app.server.address import Serving
from app.server.startup_server import StartupServer
from app.server.workbench import serve_until_closed
from app.storage import rescue
from tracker.errors import SessionError, TrackerError
from tracker.session.lock import SessionLock
from tracker.session.session import load_session
from tracker.session.store import connection
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    """The user's folders for rescue files, best first."""
    folders = [tmp_path / name for name in ("data", "temporary", "home")]
    monkeypatch.setenv("XDG_DATA_HOME", str(folders[0]))
    monkeypatch.setenv("HOME", str(folders[2]))
    monkeypatch.setattr(rescue, "tempfile", SimpleNamespace(gettempdir=lambda: str(folders[1])))
    for folder in folders:
        folder.mkdir()
    return folders


@pytest.fixture
def open_with(session, monkeypatch):
    """Open the session as the command line does, with work in place of the server; returns the lines that it says."""

    def open_it(work):
        controllers = []
        real = workbench.Controller
        with monkeypatch.context() as patch:

            def remembered(*words):
                controllers.append(real(*words))
                return controllers[-1]

            async def served(*_):
                work(controllers[0])

            patch.setattr(workbench, "Controller", remembered)
            patch.setattr(workbench, "serve_forever", served)
            lines = []
            try:
                with SessionLock(session), StartupServer(Serving(port=0, browser=False)) as doorway:
                    serve_until_closed(load_session(session), doorway, KernelCompiler(), lines.append)
            finally:
                open_it.lines = lines
        return lines

    return open_it


def full(*_, **__):
    raise SessionError("annotations cannot be written: the disk is full; make room")


def edit_on_a_full_disk(controller):
    drag(controller, "torso", (10.0, 0.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(AnnotationStore, "commit", full)
        patch.setattr(AnnotationStore, "amend", full)
        drag(controller, "left_wrist", (10.0, 0.0))
        at = (100.0, 100.0)
        controller.pinning.begin(1, 0, 0, 0, "left_wrist", at, False)
        controller.pinning.end(1)
        controller.close()
        edit_on_a_full_disk.values = controller.state.poses[0]
        controller.close = lambda: None  # the disk is still full when the program ends


def test_unsaved_edits_are_kept_offered_and_written(open_with, session, run, places):
    with pytest.raises(TrackerError, match=r"the disk is full.*kept in .*rescue.*'quadrille restore .*session' writes"):
        open_with(edit_on_a_full_disk)
    (path,) = (places[0] / "quadrille" / "rescue").iterdir()
    assert path.stat().st_mode & 0o077 == 0
    before = stored(session)[0].values
    assert not np.array_equal(before, edit_on_a_full_disk.values)

    (line,) = open_with(lambda controller: None)
    assert f"are kept in {path}" in line
    assert "2 edits of 20" in line
    assert "quadrille restore" in line

    status, out, _ = run("restore", session)
    assert (status, "wrote 2 rescued edits" in out) == (0, True)
    assert not path.exists()
    found = stored(session)[0]
    np.testing.assert_array_equal(found.values, edit_on_a_full_disk.values)  # to the bit
    assert found.keyframe
    with AnnotationStore(session / "annotations.sqlite") as store:
        assert [p.point for p in store.pins("person", 0)] == ["left_wrist"]
        assert [entry.label for entry in store.history()] == [
            "set pin left wrist in FRONT, frame 0", "drag left wrist, frame 0", "drag torso, frame 0",
        ]  # fmt: skip
    assert open_with(lambda controller: None) == []


def test_a_program_that_could_not_save_ends_with_status_1(run, session, monkeypatch):
    def failing(*_):
        raise TrackerError("edits are not saved: the disk is full; they are kept in /x/rescue.json")

    monkeypatch.setattr("app.server.workbench.serve_until_closed", failing)
    status, out, err = run("open", session, "--no-browser", "--port", "0")
    assert (status, out, "kept in /x/rescue.json" in err) == (1, "", True)


@pytest.mark.slow
@pytest.mark.parametrize("n_full", [1, 2])
def test_the_next_folder_is_taken_where_there_is_no_room(open_with, places, n_full):
    for folder in places[:n_full]:
        shutil.rmtree(folder)
        folder.write_text("no folder")
    with pytest.raises(TrackerError, match=f"kept in {places[n_full]}/quadrille-rescue-"):
        open_with(edit_on_a_full_disk)
    assert len(open_with(lambda controller: None)) == 1


@pytest.mark.slow
def test_edits_of_a_folder_that_is_away_at_the_end_are_kept(open_with, session, run, tmp_path):
    def edit(controller):
        drag(controller, "torso", (10.0, 0.0))
        session.rename(tmp_path / "away")
        drag(controller, "left_wrist", (10.0, 0.0))
        edit.values = controller.state.poses[0]

    with pytest.raises(TrackerError, match=r"are not there .* they are kept in .*rescue"):
        open_with(edit)
    assert not session.exists()
    (tmp_path / "away").rename(session)
    (session / "lock.json").unlink()  # went away too; it counts as left by a dead program when this process has ended
    assert run("restore", session)[0] == 0
    np.testing.assert_array_equal(stored(session)[0].values, edit.values)


@pytest.mark.slow
def test_a_damaged_rescue_file_is_refused_and_changes_nothing(open_with, session, run, places):
    with pytest.raises(TrackerError):
        open_with(edit_on_a_full_disk)
    (path,) = (places[0] / "quadrille" / "rescue").iterdir()
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    before = stored(session)[0].values
    status, _, err = run("restore", session)
    assert status == 1
    assert "not as it was written: its checksum differs" in err
    np.testing.assert_array_equal(stored(session)[0].values, before)


@pytest.mark.slow
def test_rescued_edits_are_of_one_session(open_with, session, tmp_path):
    with pytest.raises(TrackerError):
        open_with(edit_on_a_full_disk)
    assert len(rescue.find(session, store_id(session))) == 1
    assert rescue.find(tmp_path / "copy", store_id(session)) == []  # a copy of the session, beside it
    assert rescue.find(session, "another") == []


def test_edits_of_another_folder_are_offered_and_written_on_request_alone(open_with, session, run, tmp_path, places):
    """A copy of a session has its id, and the folder that the edits were made in may be a drive that is away."""
    with pytest.raises(TrackerError):
        open_with(edit_on_a_full_disk)
    (path,) = (places[0] / "quadrille" / "rescue").iterdir()
    copy = tmp_path / "copy"
    session.rename(copy)
    before = (copy / "annotations.sqlite").read_bytes()
    status, out, _ = run("restore", copy)
    assert (status, f"made in {session}" in out or f"into {session}" in out, f"--rescue {path}" in out) == (
        0,
        True,
        True,
    )
    assert (copy / "annotations.sqlite").read_bytes() == before
    session.mkdir()  # where the drive was mounted
    assert [found.origin for found in rescue.find(copy, store_id(copy))] == [str(session)]
    status, out, _ = run("restore", copy, "--rescue", path)
    assert (status, "wrote 2 rescued edits" in out) == (0, True)
    np.testing.assert_array_equal(stored(copy)[0].values, edit_on_a_full_disk.values)
    assert path.exists()


@pytest.mark.slow
def test_a_rescue_file_of_another_session_is_refused(open_with, session, run, tmp_path, places):
    with pytest.raises(TrackerError):
        open_with(edit_on_a_full_disk)
    (path,) = (places[0] / "quadrille" / "rescue").iterdir()
    other = shutil.copytree(SAMPLE, tmp_path / "other")
    AnnotationStore(other / "annotations.sqlite").close()
    if store_id(other) == store_id(session):
        with AnnotationStore(other / "annotations.sqlite") as store:
            store.set_setting("store_id", "another")
    status, _, err = run("restore", other, "--rescue", path)
    assert (status, "edits of another session" in err) == (1, True)


def store_id(session):
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        return store.id


@pytest.mark.slow
def test_the_end_of_the_terminal_ends_the_program_as_control_c_does(open_with, session):
    def hang_up(_):
        signal.raise_signal(signal.SIGHUP)

    open_with(hang_up)  # returns: everything was closed
    assert not (session / "lock.json").exists()


def test_a_folder_that_comes_back_gets_what_was_edited_meanwhile(opened, session, tmp_path, monkeypatch):
    monkeypatch.setattr(save_retry, "_FIRST_S", 0.05)
    controller = opened()
    drag(controller, "torso", (10.0, 0.0))
    session.rename(tmp_path / "away")
    drag(controller, "left_wrist", (10.0, 0.0))
    drag(controller, "right_wrist", (10.0, 0.0))
    values = controller.state.poses[0]
    assert "bring the session's folder back" in controller.state.save_error
    assert not controller.state.saved
    (tmp_path / "away").rename(session)
    wait_for(lambda: controller.state.saved, 10)
    assert controller.state.save_error is None
    np.testing.assert_array_equal(stored(session)[0].values, values)
    assert controller.state.undo == "drag right wrist, frame 0"
    controller.history.undo()
    controller.history.undo()
    assert controller.state.undo == "drag torso, frame 0"


def test_waiting_edits_do_not_keep_the_program_from_working(opened, session, monkeypatch):
    """Another program holds the file: attempts that nobody asked for do not wait for it under the lock."""
    monkeypatch.setattr(save_retry, "_FIRST_S", 0.05)
    monkeypatch.setattr(connection, "_TIMEOUT_S", 3600.0)  # as long would they wait
    controller, commit = opened(), AnnotationStore.commit
    monkeypatch.setattr(AnnotationStore, "commit", full)
    drag(controller, "torso", (10.0, 0.0))
    monkeypatch.setattr(AnnotationStore, "commit", commit)
    other = sqlite3.connect(session / "annotations.sqlite", isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    controller.session_state.set(follow=False)  # plans an attempt
    wait_for(lambda: "locked" in (controller.state.save_error or ""), 5)
    work = threading.Thread(target=controller.navigation.seek, args=(3,), daemon=True)
    work.start()
    wait_for(lambda: not work.is_alive())
    other.execute("ROLLBACK")
    wait_for(lambda: controller.state.saved, 10)
    other.close()


async def test_a_page_shows_what_is_offered(opened):
    async with visiting(opened(), ["1 edit is kept in x"]) as page:
        assert (await page.hear("notice"))["text"] == "1 edit is kept in x"
