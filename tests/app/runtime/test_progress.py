"""Progress of long work: the rate and the time left are those of a usual item."""

from app.runtime.progress import Pace, Reporter, pace_text, time_left_text


def paced(durations):
    times = [0.0]
    for d in durations:
        times.append(times[-1] + d)
    clock = iter(times)
    pace = Pace(lambda: next(clock))
    for _ in durations:
        pace.tick()
    return pace


def test_time_left_ignores_compiling():
    assert paced([90.0]).item_s is None
    assert paced([90.0, 0.5]).item_s == 0.5
    assert paced([90.0, 0.4, 0.6, 40.0, 0.5]).item_s == 0.5  # a search compiled its kernels later
    assert pace_text(paced([90.0, 0.5, 0.5]), 100) == ", 2.0/s, 50 s left"
    assert pace_text(paced([90.0, 2.0]), 300) == ", 0.5/s, 10 min left"
    assert pace_text(paced([90.0]), 100) == ""
    assert pace_text(paced([90.0, 0.5]), 0) == ", 2.0/s"


def test_frames_that_are_hard_count():
    """A few searched frames among quick ones are work like any other, unless they stand out by far."""
    assert paced([90.0, *[0.5, 0.5, 2.0] * 5]).item_s == 1.0


def test_items_that_come_in_bursts():
    """A tracker that works ahead gives several frames at once."""
    assert paced([90.0, 0.25, 0.0]).item_s == 0.125
    assert paced([90.0, *[0.5, 0.0, 0.0, 0.0] * 6, 30.0]).item_s == 0.125


def test_lines_where_there_is_no_terminal(capsys, monkeypatch):
    times = iter([0.0, 60.0, 60.5, 61.0])
    monkeypatch.setattr(Pace.__init__, "__defaults__", (lambda: next(times),))
    with Reporter().over(3, "tracking") as tick:
        for _ in range(3):
            tick()
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["tracking: 1 of 3", "tracking: 2 of 3, 2.0/s, 0 s left", "tracking: 3 of 3, 2.0/s"]


def test_time_left_of_work_whose_steps_differ_in_size():
    """A step of many hundredths at once said "439781.4/s, 0 s left"."""
    assert time_left_text(0.25, 30.0) == ", 90 s left"
    assert time_left_text(0.1, 60.0) == ", 9 min left"
    assert time_left_text(0.0, 5.0) == time_left_text(1.0, 5.0) == ""


def test_shares_are_lines_where_there_is_no_terminal(capsys, monkeypatch):
    times = iter([0.0, 30.0, 40.0])
    monkeypatch.setattr("app.runtime.progress.time.monotonic", lambda: next(times))
    with Reporter().share("finding people") as advance:
        for share in (0.5, 0.505, 1.0):  # a line for each tenth
            advance(share)
    assert capsys.readouterr().err.splitlines() == ["finding people: 50%, 30 s left", "finding people: 100%"]
