"""When the 3-D view follows: what is passed over, and that the last state never is."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from app.scene3d import throttle
from app.scene3d.throttle import Throttle

SOFTWARE = frozenset({1})


@pytest.fixture
def clock(monkeypatch):
    """Time that only sleeping passes; `meanwhile` is done in the sleep."""
    clock = SimpleNamespace(now=100.0, meanwhile=lambda: None)

    def sleep(seconds):
        clock.now += seconds
        clock.meanwhile()

    monkeypatch.setattr(throttle, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep))
    return clock


@pytest.fixture
def controller(opened):
    """Holds a state that tests replace."""
    return SimpleNamespace(state=opened().state)


def test_with_a_graphics_card_everything_is_drawn_at_once(controller, clock):
    drawn = Throttle(controller)
    for frame in (1, 2, 3):
        controller.state = replace(controller.state, frame=frame)
        assert drawn.due(controller.state) is controller.state
    assert clock.now == 100.0


def test_work_is_drawn_but_once_in_a_while(controller, clock):
    running = replace(
        controller.state, pages_pausing_3d=SOFTWARE, search=replace(controller.state.search, running=True)
    )
    drawn, due = Throttle(controller), []
    for seconds in (0.0, 1.9, 2.1, 3.9):
        clock.now = 100.0 + seconds
        due.append(drawn.due(running) is not None)
    assert due == [True, False, True, False]
    ended = replace(running, search=replace(running.search, running=False))
    assert drawn.due(ended) is ended


def test_frames_that_go_by_are_passed_over_and_the_one_that_stays_is_drawn(controller, clock):
    controller.state = replace(controller.state, pages_pausing_3d=SOFTWARE, frame=1)
    drawn = Throttle(controller)
    assert drawn.due(controller.state) is controller.state
    left, stays = replace(controller.state, frame=5), replace(controller.state, frame=9)
    controller.state = left

    def go_on():
        controller.state = stays

    clock.meanwhile = go_on
    assert drawn.due(left) is None
    assert drawn.due(stays) is stays
    # A film of many frames is seen now and then all the same.
    frames = iter(range(10, 100))

    def play():
        controller.state = replace(stays, frame=next(frames))

    clock.meanwhile, n_drawn = play, 0
    for _ in range(40):
        play()
        n_drawn += drawn.due(controller.state) is not None
    assert n_drawn == 40 * 0.25 // 2.0


def test_a_camera_view_shows_bodies_and_image_together(controller, clock):
    drawn = Throttle(controller)
    controller.state = replace(controller.state, pages_pausing_3d=SOFTWARE, frame=7, snapped=0)
    assert drawn.due(controller.state) is controller.state
    assert clock.now == 100.0
