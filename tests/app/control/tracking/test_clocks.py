"""The clocks of the cameras in the page's program: nudges, their history, estimates, and a fast moment."""

import threading

import pytest
from gestures import drag, wait_for

from app.control.tracking import clocks as clocks_room
from tracker.errors import SessionError, TrackerError
from tracker.session.session import load_session
from tracker.session.synchronize import FoundStart

FRONT, BACK = 0, 2


@pytest.fixture
def controller(session, opened):
    """The sample without its last two frames, so that each camera can begin up to two frames later."""
    toml = session / "session.toml"
    n = load_session(session).n_frames
    toml.write_text(toml.read_text("utf-8").replace(f"n_frames = {n}", f"n_frames = {n - 2}"), "utf-8")
    return opened()


def starts(session):
    return [c.start_frames for c in session.cameras]


def labels(controller):
    return [e.label for e in controller.history.entries(100) if not e.undone]


def test_successive_nudges_of_a_camera_are_one_entry_of_the_history(controller):
    first = controller.frames.image(9, FRONT)
    for frames in (1, 1, -0.25):
        controller.clocks.nudge(FRONT, frames)
    assert starts(load_session(controller.session.folder)) == starts(controller.session) == [1.75, 0, 0, 0]
    assert labels(controller) == ["clock of FRONT"]
    assert controller.frames.image(7, FRONT) == first
    controller.clocks.nudge(BACK, 0.5)
    controller.history.undo()
    controller.clocks.nudge(FRONT, 0.25)  # after an undo another gesture begins
    assert labels(controller) == ["clock of FRONT"] * 2
    controller.history.undo()
    assert starts(controller.session) == [1.75, 0, 0, 0]
    controller.history.undo()
    assert starts(load_session(controller.session.folder)) == starts(controller.session) == [0] * 4
    assert controller.frames.image(9, FRONT) == first
    controller.history.redo()
    assert starts(controller.session) == [1.75, 0, 0, 0]


def test_an_edit_ends_the_gesture_and_poses_are_of_the_former_clock(controller):
    controller.clocks.nudge(FRONT, 1)
    drag(controller, "left_wrist", (6.0, -9.0))
    controller.clocks.nudge(FRONT, -0.5)
    assert labels(controller)[::2] == ["clock of FRONT"] * 2
    wait_for(lambda: controller.state.calibration.outdated == {0: (0,)})


def test_a_clock_beyond_the_footage_is_refused_and_leaves_no_entry(controller):
    with pytest.raises(SessionError, match="'FRONT': expected an offset of at most 2, since the session has"):
        controller.clocks.nudge(FRONT, 3)
    with pytest.raises(SessionError, match="give each of the others an offset of 4"):
        controller.clocks.nudge(FRONT, -4)
    assert (labels(controller), starts(controller.session)) == ([], [0] * 4)


def test_a_clear_estimate_is_taken(controller, monkeypatch):
    found = [FoundStart("RIGHT", 0.4, 0.7, 9.0, True, 1e-5), FoundStart("BACK", 3.0, None, 1.1, False)]
    monkeypatch.setattr(clocks_room, "find_starts", lambda *_: (found, ["the sound and the time code disagree"]))
    controller.clocks.estimate("sound")
    wait_for(lambda: controller.state.clocks.found and not controller.state.clocks.running)
    with pytest.raises(TrackerError, match="expected a clear estimate of the clock of 'BACK', found none"):
        controller.clocks.take(BACK)
    controller.clocks.take(1)
    assert controller.session.cameras[1].clock.rate == 1e-5
    assert (starts(controller.session), labels(controller)) == ([0, 0.4, 0, 0], ["clock of RIGHT by sound"])
    assert controller.state.clocks.notes == ("the sound and the time code disagree",)


def test_a_clock_stays_while_an_estimate_is_made_relative_to_it(controller, monkeypatch):
    ends = threading.Event()
    monkeypatch.setattr(clocks_room, "find_starts", lambda *_: (ends.wait(10) and [], []))
    controller.clocks.estimate("sound")
    with pytest.raises(TrackerError, match="expected no other work on the clocks under way"):
        controller.clocks.nudge(FRONT, 1)
    ends.set()
    wait_for(lambda: not controller.state.clocks.running)
    assert starts(controller.session) == [0] * 4


def test_an_estimate_without_evidence_ends_with_its_sentence(controller):
    for way, said in (("sound", "Expected sound in the videos"), ("motion", "Expected at least 3 frames with poses")):
        controller.clocks.estimate(way)
        wait_for(lambda: not controller.state.clocks.running)
        assert (controller.state.clocks.failed, said in controller.state.clocks.message) == (True, True)


@pytest.mark.slow
def test_without_poses_the_pictures_show_a_fast_moment(controller):
    controller.clocks.find_moment((FRONT, BACK))
    wait_for(lambda: controller.state.clocks.moment)
    found = controller.state.clocks
    assert (found.views, found.moment.source) == ((FRONT, BACK), "pictures")
    assert 0 < found.moment.frame < controller.session.n_frames
