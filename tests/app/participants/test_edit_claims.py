"""Runs and work on ranges take turns with others at one pose, and what is refused leaves nothing running."""

import threading

import pytest
from gestures import FRONT, drag, drag_on, pixel_of, start_run, wait_for

from app.control.tracking import ranges
from app.storage.edit_claims import EditClaimError
from tracker.errors import TrackerError


def begin_run(user, tracker):
    """Track from frame 2 until frame 3 is done; the next step, for which pause and stop wait, is let go soon."""
    start_run(user)
    tracker.go_on(user, 1, at=3)
    threading.Timer(0.2, tracker.let_go, (1,)).start()


def test_a_paused_run_goes_on_only_when_its_frames_are_free(anna, ben, tracker):
    begin_run(anna, tracker)
    anna.tracking.pause()
    ben.navigation.seek(5)
    ben.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(ben, "torso")))
    with pytest.raises(EditClaimError, match="ben drags on frame 5"):
        anna.tracking.resume()
    assert not anna.state.track.running
    ben.dragging.end(1)
    anna.tracking.resume()
    tracker.go_on(anna, 1000)
    assert anna.state.track.message == "done: 4 frames, 1 doubtful"


def test_a_run_whose_poses_are_refused_ends_with_a_notice(anna, ben, tracker):
    start_run(anna)
    ben.navigation.seek(4)
    ben.session_state.set(is_pin_held=True)  # as if begun a moment before the run
    tracker.go_on(anna, 1000)
    assert not anna.state.track.running
    assert anna.state.track.failed
    assert "ben sets a pin on frame 4" in anna.state.track.notice
    assert anna.state.saved
    ben.session_state.set(is_pin_held=False)
    anna.navigation.seek(2)
    anna.tracking.start(False, 6)  # nothing is left of the former run
    tracker.let_go(1000)
    wait_for(lambda: anna.state.track.message.startswith("done"))


def test_a_stop_reports_what_it_could_not_save(anna, ben, tracker):
    begin_run(anna, tracker)
    ben.navigation.seek(4)
    ben.session_state.set(is_pin_held=True)
    anna.tracking.stop()
    assert anna.state.track.notice.startswith("stopped, because expected frame 4 to be free")
    assert not anna.state.track.running
    assert anna.state.saved


def test_a_refused_mark_leaves_nothing_running(anna, ben):
    drag(anna, "torso", (4.0, 0.0))
    anna.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(anna, "torso")))
    with pytest.raises(EditClaimError, match="anna drags on frame 0"):
        ben.ranges.mark(0, 0, "none")
    assert not ben.ranges.running
    assert not ben.state.ranges.running
    anna.dragging.end(1)
    ben.ranges.mark(0, 0, "none")
    assert ben.state.ranges.message == "marked 1 frame"


def test_work_on_a_range_that_fails_at_once_leaves_nothing_running(monkeypatch, anna):
    drag(anna, "torso", (4.0, 0.0))

    def fail(*args):
        raise TrackerError("expected a disk, found none; bring it back")

    with monkeypatch.context() as gone:
        gone.setattr(anna.session_state.saver, "write", fail)
        with pytest.raises(TrackerError, match="found none"):
            anna.ranges.mark(0, 0, "none")
    assert (
        anna.state.ranges.message == "stopped, because expected a disk, found none; bring it back: marked 0 of 1 frames"
    )
    anna.ranges.mark(0, 0, "none")


def test_work_on_a_range_has_its_turn(people, monkeypatch, anna, ben):
    for frame in (2, 8):
        drag_on(anna, frame, "torso", (4.0, 0.0))
    monkeypatch.setattr(ranges, "AT_ONCE", 2)  # in the background, two frames at a time
    is_held, may_go_on = threading.Event(), threading.Event()

    def held(changes, pieces=ranges._pieces):
        for piece in pieces(changes):
            yield piece
            is_held.set()
            assert may_go_on.wait(20)

    monkeypatch.setattr(ranges, "_pieces", held)
    anna.ranges.interpolate(2, 8)
    assert is_held.wait(20)
    ben.navigation.seek(6)
    with pytest.raises(EditClaimError, match="anna is interpolating frames 3 to 7"):
        drag(ben, "torso", (4.0, 0.0))
    assert people.present()[0].doing == "is interpolating frames 3 to 7"
    may_go_on.set()
    wait_for(lambda: not anna.state.ranges.running)
    assert anna.state.ranges.message == "interpolated 5 frames"
    drag(ben, "torso", (4.0, 0.0))
