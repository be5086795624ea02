"""The row of video frame k lies at frame k of the session, or the file is refused with the option that decides."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tracker.errors import FormatError, Remedy
from tracker.formats.trc import MarkerTable, read_trc, write_trc
from tracker.session.row_placement import RowPlacement, listed_frames, place_rows

NTSC = {24: 24000 / 1001, 30: 30000 / 1001, 60: 60000 / 1001, 120: 120000 / 1001}


def table(frames, times, rate, values=None, origin=None):
    """One point whose x is the value of its row."""
    points = np.zeros((len(frames), 1, 3))
    points[:, 0, 0] = np.arange(len(frames)) if values is None else values
    return MarkerTable(("p",), np.asarray(frames), np.asarray(times, dtype=float), points, rate, origin)


def line(n, rate, frames=None):
    """A point that moves 1 m a second, in a file whose Frame# and Time count from 0."""
    frames = np.arange(n) if frames is None else np.asarray(frames)
    return table(frames, frames / rate, rate, frames / rate)


def placed(file, fps, **known):
    return place_rows(file, "TRC file x.trc", fps, RowPlacement(**known))


def by_frame(file):
    return dict(zip(file.frames.tolist(), file.points[:, 0, 0].tolist(), strict=True))


@st.composite
def files(draw):
    """A file of the frames of a video, written in any of the ways that tools write it, and the frame of each row."""
    nominal = draw(st.sampled_from([24, 25, 30, 50, 60, 100, 120, 240]))
    fps = draw(st.sampled_from([nominal, NTSC.get(nominal, nominal)]))
    n_frames = draw(st.sampled_from([40, 300, 3000]))
    start = draw(st.sampled_from([0, 1, 2, 20, 37, n_frames - 3]).filter(lambda k: k < n_frames - 1))
    stop = draw(st.sampled_from([n_frames, n_frames - 1, start + 2, start + 1]).filter(lambda k: k > start))
    truth = np.arange(start, stop)
    if draw(st.booleans()):  # a gap whose rows are cut out
        truth = truth[(truth < start + 2) | (truth > start + 12)]
    counting = draw(st.sampled_from(["from 0", "from 1", "restart at 0", "restart at 1"]))
    frames = truth + {"from 0": 0, "from 1": 1, "restart at 0": -start, "restart at 1": 1 - start}[counting]
    data_rate = draw(st.sampled_from([fps, float(nominal)]))
    stamp_rate = draw(st.sampled_from([fps, data_rate]))
    stamps = draw(st.sampled_from(["from 0", "from 1", "restart"]))
    times = (truth + {"from 0": 0, "from 1": 1, "restart": -start}[stamps]) / stamp_rate
    times = np.round(times, draw(st.sampled_from([2, 3, 6, 15])))
    origin = draw(st.sampled_from([None, 0, 1, start, start + 1, int(frames[0])]))
    file = table(frames, times, data_rate, truth, origin)
    says_nothing = start > 0 and counting.startswith("restart") and stamps == "restart" and origin in (None, 0, 1)
    # These two say frame 0 and frame `start + 1` as clearly as files that begin there.
    like_frame_0 = start == 1 and int(frames[0]) in (0, 1) and times[0] == 0
    like_next = start > 0 and counting == "from 1" and stamps == "from 1" and origin in (None, 0, start + 1)
    assume(not (says_nothing or like_frame_0 or like_next))
    return file, fps, n_frames, truth


@pytest.mark.slow
@given(files())
def test_a_row_lies_at_its_frame_or_the_file_is_asked_about(case):
    file, fps, n_frames, truth = case
    refusal = None
    try:
        found = placed(file, fps, n_frames=n_frames)
    except FormatError as error:
        refusal = error
    if refusal is not None:
        assert refusal.remedy.code in ("choose_first_frame", "choose_clock")
        assert "TRC file x.trc" in str(refusal)
        found = placed(file, fps, n_frames=n_frames, first_frame=int(truth[0]), clock="frames")
    assert found.frames.tolist() == truth.tolist()
    np.testing.assert_array_equal(found.points, file.points)


@given(st.integers(1, 60), st.sampled_from([24, 25, 30, 60]), st.booleans())
def test_cut_files_of_plain_writers_are_placed_without_a_question(start, rate, from_0):
    """Frame# and Time kept from the recording: counted from 0 as in Pose2Sim, or from 1 as in OpenSim."""
    truth = np.arange(start, start + 30)
    number = truth + (0 if from_0 else 1)
    assume(number[0] > 1 or not from_0)
    found = placed(table(number, truth / rate, rate, truth, int(number[0])), rate, n_frames=200)
    assert found.frames.tolist() == truth.tolist()
    assert any(f"is frame {start}" in note for note in found.notes)


@pytest.mark.parametrize("start_s", [1.7e9, 1.732e9 + 0.123456, 45_000.0, 120.5, 1e8])
@pytest.mark.parametrize("number", [0, 1, 20])
@pytest.mark.parametrize("rate", [25, 30000 / 1001, 60])
def test_time_of_another_clock_places_no_row(start_s, number, rate):
    """Unix time, the time of day, or seconds since a camera was switched on."""
    file = table(number + np.arange(30), start_s + np.round(np.arange(30) / rate, 6), rate)
    if number < 2:
        found = placed(file, rate, n_frames=60)
        assert found.frames.tolist() == list(range(30))
        assert any("is frame 0" in note for note in found.notes)
        return
    with pytest.raises(FormatError, match=r"first row may be frame 20 .* or frame 19"):
        placed(file, rate, n_frames=60)
    with pytest.raises(FormatError, match=r"Time begins at .* beyond the frames"):
        placed(file, rate, n_frames=60, clock="time")
    assert placed(file, rate, n_frames=60, first_frame=7).frames.tolist() == list(range(7, 37))


def test_odd_parts_of_a_file_are_named():
    file = replace(line(5, 30), notes=("it is odd",))
    assert placed(file, 30, n_frames=5).notes == ("it is odd",)


def test_without_a_session_unix_time_places_no_row():
    file = table(1 + np.arange(30), 1.7e9 + np.arange(30) / 30, 30)
    assert placed(file, 30).frames.tolist() == list(range(30))


@pytest.mark.parametrize(("nominal", "fps"), NTSC.items())
def test_rates_of_television_are_one_clock(nominal, fps):
    for rate, session in ((nominal, fps), (fps, nominal)):
        found = placed(line(5000, rate), session, n_frames=5000)
        assert found.frames[-1] == 4999
        assert len(found.notes) == 1
        assert "taken for the session's" in found.notes[0]
    half = placed(line(5000, 2 * nominal), fps, n_frames=2500)  # 60 per second is twice 29.97
    np.testing.assert_allclose(half.points[:, 0, 0], np.arange(2500) / nominal, atol=1e-9)


@pytest.mark.parametrize(("file_rate", "fps", "n"), [(60, 30, 5), (30, 60, 17), (100, 60, 5), (50, 30, 5)])
def test_other_rates_by_time(file_rate, fps, n):
    moved = placed(line(9, file_rate), fps)
    assert moved.frames.tolist() == list(range(n))
    np.testing.assert_allclose(moved.points[:, 0, 0], np.arange(n) / fps, atol=1e-12)
    assert moved.rate == fps
    assert moved.notes == (f"the file was resampled from {file_rate} to {fps} frames per second",)


def test_another_rate_from_a_later_frame():
    moved = placed(line(0, 100, np.arange(200, 401)), 30, n_frames=200)
    assert (moved.frames[0], moved.frames[-1]) == (60, 120)
    np.testing.assert_allclose(moved.points[:, 0, 0], moved.frames / 30, atol=1e-9)
    chosen = placed(line(0, 100, np.arange(200, 401)), 30, n_frames=200, first_frame=7)
    assert by_frame(chosen)[7] == pytest.approx(2.0)
    assert by_frame(chosen)[37] == pytest.approx(3.0)


def test_same_rate_keeps_the_rows():
    same = line(3, 59.94, [0, 2, 5])
    found = placed(same, 59.95)
    assert found.points is same.points
    assert found.frames.tolist() == [0, 2, 5]
    assert found.notes == ()


def test_a_tiny_file_with_far_frames_is_not_resampled_to_gigabytes():
    with pytest.raises(FormatError, match="found 1000000000001 frames of 1 points; correct the file's DataRate"):
        placed(line(2, 0.001, [0, 10_000_000]), 100.0)


def test_missing_values_do_not_spread_over_rows_that_are_there():
    source = line(5, 60)
    source.points[3] = np.nan
    assert placed(source, 30).points[:, 0, 0] == pytest.approx([0, 2 / 60, 4 / 60])
    assert np.isnan(placed(source, 120).points[:, 0, 0]).tolist() == [False] * 5 + [True] * 3 + [False]
    source = line(3, 60)
    source.points[1] = np.nan
    assert np.isnan(placed(source, 120).points[:, 0, 0]).tolist() == [False] + [True] * 3 + [False]


def test_no_position_is_invented_in_a_gap():
    found = placed(line(0, 100, [*range(100), *range(200, 300)]), 25)
    inside = (found.frames > 99 / 4) & (found.frames < 50)
    assert np.isnan(found.points[inside]).all()
    assert np.isfinite(found.points[~inside]).all()
    assert inside.sum() == 25


CONTRADICTIONS = [
    # Frame#, Time, DataRate, OrigDataStartFrame, session's rate, its frames, what decides: first frames, or the clock
    (np.arange(20, 50), np.arange(30) / 30, 30, 20, 30, 60, "20 or 0"),
    (np.arange(1, 31), np.arange(20, 50) / 30, 30, 1, 30, 60, "1 or 20"),
    (np.arange(1, 31), np.arange(30) / 30, 30, 20, 30, 60, "0 or 20"),
    (np.arange(1, 31), np.arange(1, 31) / 30, 30, 1, 30, 60, "1 or 0"),
    (np.arange(1, 31), np.zeros(30), 30, 1, 30, 60, "1 or 0"),
    (np.arange(60), np.arange(60) / 30, 60, 0, 30, 60, "clock"),  # DataRate against Time
    (np.arange(60), np.arange(60) / 60, 60, 0, 30, 60, "clock"),  # against the footage: a row for each frame
    (np.arange(1000), np.arange(1000) / 25, 25, 0, 24.8, 2000, "clock"),  # rounded, or another clock
    (np.arange(50), np.r_[0:25, 45:70] / 30, 30, 0, 30, 80, "clock"),  # a gap in Time alone
]


@pytest.mark.parametrize(("frames", "times", "rate", "origin", "fps", "n_frames", "expected"), CONTRADICTIONS)
def test_contradictions_are_asked_about(frames, times, rate, origin, fps, n_frames, expected):
    file = table(frames, times, rate, origin=origin)
    with pytest.raises(FormatError) as caught:
        placed(file, fps, n_frames=n_frames)
    clock = Remedy("choose_clock", fps=f"{fps:g}")
    assert caught.value.remedy == (clock if expected == "clock" else Remedy("choose_first_frame", frames=expected))
    decided = placed(file, fps, n_frames=n_frames, first_frame=5)
    assert decided.frames.tolist() == list(range(5, 5 + len(frames)))
    assert "is frame 5" in decided.notes[0]


def test_the_users_clock_decides():
    frames, times = np.arange(50), np.r_[0:25, 45:70] / 30
    assert placed(table(frames, times, 30), 30, clock="frames").frames.tolist() == frames.tolist()
    by_time = placed(table(frames, times, 30), 30, clock="time")
    assert by_time.frames.tolist() == [*range(25), *range(45, 70)]
    twice = placed(line(60, 60), 30, n_frames=60, clock="time")
    np.testing.assert_allclose(twice.points[:, 0, 0], np.arange(30) / 30, atol=1e-9)
    with pytest.raises(FormatError, match="Time that rises"):
        placed(table(frames, 0 * times, 30), 30, clock="time")


def test_rates_that_videos_declare_tell_that_rows_are_their_frames():
    """High-speed footage declares 30 per second; a tool that reads it writes that as DataRate."""
    file = line(500, 30)
    with pytest.raises(FormatError) as caught:
        placed(file, 240, n_frames=5000, declared_rates=(30.0,))
    assert caught.value.remedy == Remedy("choose_clock", fps="240")
    assert placed(file, 240, n_frames=5000, declared_rates=(30.0,), clock="frames").frames[-1] == 499
    assert placed(file, 240, n_frames=5000).frames[-1] == 8 * 499


def test_a_file_written_with_a_later_start_comes_back_there(tmp_path):
    points = np.arange(21.0).reshape(7, 1, 3)
    write_trc(tmp_path / "a.trc", ["p"], points, 59.94, frames=range(20, 27))
    found = placed(read_trc(tmp_path / "a.trc"), 60000 / 1001, n_frames=60)
    assert found.frames.tolist() == list(range(20, 27))
    np.testing.assert_allclose(found.points, points, atol=1e-6)


def test_frames_before_the_recording_are_kept_apart():
    found = placed(line(0, 30, range(-5, 20)), 30, n_frames=60)
    assert found.frames.tolist() == list(range(-5, 20))


def test_ranges_of_frames():
    assert listed_frames([3, 10, 11, 12, 19]) == "3, 10 to 12, 19"
    assert listed_frames([4]) == "4"
    assert replace(line(3, 30), origin=2).origin == 2
