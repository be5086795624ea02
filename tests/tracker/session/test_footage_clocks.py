"""Footage is paired by the clocks in files and names, or it is named why not."""

from fractions import Fraction

import numpy as np
import pytest
from clips import encode, number, write_images
from new_sessions import assert_refused, new, noted, room

from tracker.errors import RecordingError, Remedy
from tracker.footage.camera_source import LostFrames
from tracker.footage.recording import Recording
from tracker.footage.sound import SoundSettings
from tracker.session import footage_clocks
from tracker.session.session import load_session
from tracker.session.synchronize import FoundStart, clock_disagreement
from tracker.session.synchronize import footage_clocks as clocks_of_footage

__all__ = ["room"]


def folders(room, **names):
    for name in names:
        (room / f"{name}.mp4").unlink(missing_ok=True)
    return [write_images(room / camera, [f"{n}.png" for n in of_camera]) for camera, of_camera in names.items()]


def seconds_and_microseconds(times):
    return [f"{int(t)}_{round(1e6 * (t % 1)):06d}" for t in times]


TIMES = 1698000017.9 + np.arange(20) / 30


def test_times_pair_pictures_of_cameras_that_each_lost_another(room):
    """Frame k of the session shows the pictures in their order; the clocks of the cameras know the losses."""
    front, left = np.delete(TIMES, 5), np.delete(TIMES, 11) + 0.002
    videos = folders(room, front=seconds_and_microseconds(front), left=seconds_and_microseconds(left))
    session, notes = noted(room, videos=videos, fps=30.0)
    assert [c.clock.lost for c in session.cameras] == [(LostFrames(5, 1),), (LostFrames(11, 1),)]
    for camera, own in zip(session.cameras, (front, left), strict=True):
        shown = own[0] + (own[camera.offset :] - own[0])
        taken = [(k + camera.clock.offset_frames(k)) / 30 for k in range(session.n_frames)]
        assert taken == pytest.approx(shown - left[0], abs=1e-3)
    assert notes[0].startswith("the time in the names of the pictures of all cameras pairs frames ('front' from ")
    lost = (("front", 5), ("left", 11))
    assert notes[1:] == [f"camera '{c}': frames lost by it: 1, first before its frame {k}" for c, k in lost]


def test_times_pair_pictures_of_a_camera_that_began_later(room):
    videos = folders(room, front=seconds_and_microseconds(TIMES), left=seconds_and_microseconds(TIMES[4:] + 0.003))
    session, _ = noted(room, videos=videos, fps=30.0)
    assert [c.offset for c in session.cameras] == [4, 0]
    assert session.n_frames == 16
    assert session.cameras[0].clock.ahead_frames == pytest.approx(-0.09, abs=0.001)
    with Recording(session.cameras) as recording:
        assert [int(image[0, 0, 1]) for image in recording.read(0)] == [16, 0]


@pytest.mark.filterwarnings("error")
def test_index_beside_a_clock(room):
    names = {c: [f"20240311_1425{30 + k // 9}_{k:06d}" for k in range(3, 20)] for c in ("front", "left")}
    session, notes = noted(room, videos=folders(room, **names), fps=30.0)
    assert (session.n_frames, notes) == (17, [])


def test_each_camera_lost_another_picture_by_its_index(room):
    every = [f"20240311_1425{30 + k // 9}_{k:06d}" for k in range(20)]
    videos = folders(room, front=every[:5] + every[6:], left=every[:11] + every[12:])
    expected = "camera 'front': .*front has no image with number 5, expected every number from 0 to 19"
    assert_refused(room, RecordingError, expected, videos=videos, fps=30.0)


@pytest.mark.parametrize(
    ("front", "left", "expected"),
    [
        (
            [f"14253{k // 9}_{k % 9}" for k in range(20)],
            [f"14253{k // 9}_{k % 9}" for k in range(21) if k != 5],
            r"'front'.*one number that rises by one: .*it may be 142530 to 142532 or 0 to 1",
        ),
        (
            [f"{k:03d}_{k + 7:03d}" for k in range(9)],
            [f"{k:03d}_{k + 8:03d}" for k in range(9)],
            r"'front'.*from '000_007' to '008_015' it may be 0 to 8 or 7 to 15",
        ),
        (
            [f"{k:03d}_{t}" for k, t in enumerate(seconds_and_microseconds(TIMES[:9]))],
            [f"{k:03d}_{t}" for k, t in enumerate(seconds_and_microseconds(np.delete(TIMES[:10], 4)))],
            r"'left': by their numbers 003_\S+ and 004_\S+ follow one another, by their times 1 pictures are missing",
        ),
        (
            seconds_and_microseconds(TIMES),
            seconds_and_microseconds(TIMES + 400),
            r"times in the names of \S+front are without a common span",
        ),
        (
            seconds_and_microseconds(TIMES),
            seconds_and_microseconds(TIMES[0] + np.cumsum(np.random.default_rng(0).uniform(0.1, 1, 20))),
            r"times in the names of \S+ are too uneven to show",
        ),
        ([f"f{k}" for k in range(9)], list("abcdefghi"), r"'left'.*no number alone changes from 'a' to 'i'"),
    ],
)
def test_names_that_do_not_show_the_instant(room, front, left, expected):
    videos = folders(room, front=front, left=left)
    assert_refused(room, RecordingError, expected, Remedy("pair_images"), videos=videos, fps=30.0)
    n = min(len(front), len(left))
    assert new(room, videos=videos, fps=30.0, offsets={"left": 0, "front": 0}).n_frames == n


def test_jitter_hides_no_loss(room):
    """Stamps on arrival lie up to 8 ms from even ones, a quarter of a frame."""
    rng = np.random.default_rng(3)
    late = [rng.uniform(-0.008, 0.008, 20) for _ in range(2)]
    front, left = (np.delete(TIMES + late[i], k) for i, k in enumerate((5, 11)))
    videos = folders(room, front=seconds_and_microseconds(front), left=seconds_and_microseconds(left))
    session, _ = noted(room, videos=videos, fps=30.0)
    assert [c.clock.lost for c in session.cameras] == [(LostFrames(5, 1),), (LostFrames(11, 1),)]


def test_uneven_times_of_one_trigger(room):
    names = seconds_and_microseconds(TIMES[0] + np.cumsum(np.random.default_rng(0).uniform(0.1, 1, 20)))
    session, notes = noted(room, videos=folders(room, front=names, left=names), fps=30.0)
    assert (session.n_frames, notes) == (20, [])


def test_equal_names_need_no_reading(room):
    names = [f"14253{k // 9}_{k % 9}" for k in range(20)]
    assert new(room, videos=folders(room, front=names, left=names), fps=30.0).n_frames == 20


def tagged(room, key="timecode", n=20, suffix="mp4", **values):
    paths = []
    for name, value in values.items():
        (room / f"{name}.mp4").unlink(missing_ok=True)
        paths.append(encode(room / f"{name}.{suffix}", n=n, rate=Fraction(30000, 1001), tags={key: value}))
    return paths


def test_time_codes_pair_videos(room):
    videos = tagged(room, front="00:00:59;25", left="00:01:00;02")
    session, notes = noted(room, videos=videos)
    assert [(c.offset, c.clock.ahead_frames) for c in session.cameras] == [(5, 0.0), (0, 0.0)]
    assert session.n_frames == 15
    assert notes[0] == (
        "the time code of all cameras pairs frames ('front' 00:00:59;25, 'left' 00:01:00;02): offsets front=5 left=0"
    )
    assert "'left': frames that other cameras lack are left out at its end: 5" in notes[1]
    with Recording(session.cameras) as recording:
        assert [number(image) for image in recording.read(0)] == [5, 0]


def test_time_codes_across_midnight(room):
    session, _ = noted(room, videos=tagged(room, front="23:59:59:27", left="00:00:00:01"))
    assert [c.offset for c in session.cameras] == [4, 0]


@pytest.mark.parametrize(
    ("values", "more", "expected"),
    [
        ({"front": "10:00:00:00", "left": "10:00:02:00"}, {}, ["not taken: by it the cameras have no frame in"]),
        ({"front": "10:00:00:00", "left": "10:00:00:00"}, {}, []),
        ({"front": "10:00:00:00", "left": "later"}, {}, []),
        (
            {"front": "10:00:00:00", "left": "10:00:00:05"},
            {"offsets": {"front": 2}},
            ["offsets given and the time code disagree by up to 3.0 frames: offsets front=2 left=0 by the offsets"],
        ),
        ({"front": "10:00:00:00", "left": "10:00:00:05"}, {"offsets": {"front": 5}}, []),
        ({"front": "10:00:00:00", "left": "10:00:00:05"}, {"offsets": {"front": 4}}, ["disagree by up to 1.0 frames"]),
    ],
)
def test_time_codes_that_are_not_taken(room, values, more, expected):
    session, notes = noted(room, videos=tagged(room, **values), **more)
    given = more.get("offsets", {})
    assert [c.offset for c in session.cameras] == [given.get("front", 0), 0]
    assert len(notes) == len(expected)
    assert all(words in note for words, note in zip(expected, notes, strict=True))


def test_time_codes_of_another_rate_or_of_pairs(room):
    videos = tagged(room, front="10:00:00:00", left="10:00:00:05")
    _, (note,) = noted(room, videos=videos, fps=120.0)
    assert "they are not taken: it counts at another rate than the session's 120 per second" in note
    for name, at in (("front", "10:00:00:00"), ("left", "10:00:00:05")):
        encode(room / f"{name}.mp4", n=20, rate=50, tags={"timecode": at})
    _, (note,) = noted(room, folder=room / "t")
    assert "they are not taken: it may count each two pictures as one" in note


def test_creation_times_are_named_for_what_they_are(room):
    videos = tagged(room, "creation_time", 45, front="2026-01-02T03:04:05Z", left="2026-01-02T03:04:06Z")
    session, (note,) = noted(room, videos=videos)
    assert [c.offset for c in session.cameras] == [0, 0]
    assert "offsets would be front=29.97 left=0; they are not taken: it is known to 30 frames only" in note


def test_exact_creation_times_pair_videos(room):
    times = {"front": "2026-01-02T03:04:05.101Z", "left": "2026-01-02T03:04:05.202Z"}
    session, _ = noted(room, videos=tagged(room, "creation_time", suffix="mkv", **times))
    assert [(c.offset, c.clock.ahead_frames) for c in session.cameras] == [
        (3, pytest.approx(-0.027, abs=0.001)),
        (0, 0),
    ]


@pytest.mark.parametrize(("late", "apart", "is_named"), [(5, 5, False), (9, 5, True), (4, 0, True), (0, 0, False)])
def test_time_code_against_sound(room, late, apart, is_named, monkeypatch):
    rate = SoundSettings().rate
    samples = np.random.default_rng(0).normal(size=4 * rate).astype(np.float32)
    heard = {"front": samples, "left": samples[round(late * rate * 1001 / 30000) :]}
    monkeypatch.setattr(footage_clocks, "read_sound", lambda path, name, settings: heard[name])
    session, notes = noted(room, videos=tagged(room, front="10:00:00:00", left=f"10:00:00:{apart:02}"))
    assert session.cameras[0].offset == apart
    assert any("time code and the sound disagree by up to 4.0 frames" in note for note in notes) == is_named


def chapters(room, codes, key="timecode", names=("GX010042.MP4", "GX020042.MP4")):
    (room / "left.mp4").unlink()
    (room / "left").mkdir()
    for name, code in zip(names, codes, strict=True):
        tags = {} if code is None else {key: code}
        encode(room / "left" / name, n=10, rate=Fraction(30000, 1001), tags=tags)
    encode(room / "front.mp4", n=20, rate=Fraction(30000, 1001))
    return [room / "front.mp4", room / "left"]


@pytest.mark.parametrize(
    ("codes", "key", "clock"),
    [
        (("10:00:00:25", "10:00:01:05"), "timecode", "time code"),
        (("2026-01-02T03:04:05Z", "2026-01-02T03:04:06Z"), "creation_time", "creation time"),
    ],
)
def test_chapters_are_joined_by_their_clocks(room, codes, key, clock):
    session, notes = noted(room, videos=chapters(room, codes, key))
    assert session.n_frames == 20
    assert notes == [f"camera 'left': GX010042.MP4, GX020042.MP4 follow one another by their {clock}"]
    with Recording(load_session(room / "s").cameras) as recording:
        assert [number(recording.read(k)[1]) for k in (0, 9, 10, 19)] == [0, 9, 0, 9]


@pytest.mark.parametrize(
    ("codes", "expected"),
    [
        ((None, None), r"in \S+left to follow one another, found no clock in both that shows it"),
        (("10:00:00:00", None), "no clock in both"),
        (("10:00:00:00", "11:00:00:00"), r"GX020042\.MP4 begins 3600 s after GX010042\.MP4 ends by its time code"),
        (("10:00:00:00", "10:00:00:20"), r"GX020042\.MP4 begins 0\.334 s after GX010042\.MP4 ends by its time code"),
        (("10:00:00:00", "10:00:00:00"), r"GX020042\.MP4 begins 0\.334 s before GX010042\.MP4 ends by its time code"),
    ],
)
def test_chapters_that_do_not_follow_one_another(room, codes, expected):
    assert_refused(room, RecordingError, expected, videos=chapters(room, codes))


@pytest.mark.parametrize(
    ("names", "codes", "is_named"),
    [
        (("GX010042.MP4", "GX020042.MP4"), (None, None), True),
        (("GX010042.MP4", "GX020042.MP4"), ("10:00:00:00", "10:00:00:10"), True),
        (("GX010042.MP4", "GX020042.MP4"), ("10:00:00:00", "11:00:00:10"), False),
        (("C0001.MP4", "C0002.MP4"), ("10:00:00:00", "10:00:00:10"), True),
        (("C0001.MP4", "C0002.MP4"), (None, None), False),
        (("C0001.MP4", "C0002.MP4"), ("10:00:00:00", "10:00:03:10"), False),
    ],
)
def test_a_chapter_that_is_left_out_is_named(room, names, codes, is_named):
    chapters(room, codes, names=names)
    encode(room / "front.mp4", n=10, rate=Fraction(30000, 1001))
    paths = {"left": room / "left" / names[0], "front": room / "front.mp4"}
    _, notes = noted(room, videos=(), camera_paths=paths)
    expected = f"camera 'left': {names[1]} beside {names[0]} is the next chapter of its recording and is not used"
    assert [note.startswith(expected) for note in notes] == [True] * is_named


def test_names_that_show_nothing_contradict_no_flash(room):
    videos = folders(room, front=[f"f{k}" for k in range(9)], left=list("abcdefghi"))
    session = new(room, videos=videos, fps=30.0, offsets={"left": 0, "front": 0})
    assert clock_disagreement(session, "flash", [FoundStart("left", 5.0, None, 9.0, True)]) == []


@pytest.mark.parametrize("names", [("GX010042.MP4", "GX020042.MP4"), ("C0001.MP4", "C0002.MP4")])
def test_chapters_of_one_recording_are_no_two_cameras(room, names):
    chapters(room, ("10:00:00:00", "10:00:00:10"), names=names)
    front, left = (room / "left" / name for name in names)
    expected = f"'front' and 'left' have chapters of one recording, {names[0]} and {names[1]}; give each camera its own"
    assert_refused(room, RecordingError, expected, videos=(), camera_paths={"front": front, "left": left})


def numbered_and_timed(first, times):
    return [f"{first + k:04d}_{round(1e6 * t)}" for k, t in enumerate(times)]


def test_numbers_that_times_contradict_are_named(room):
    names = {"front": numbered_and_timed(0, TIMES), "left": numbered_and_timed(0, TIMES + 4 / 30)}
    session, (note,) = noted(room, videos=folders(room, **names), fps=30.0)
    assert [c.offset for c in session.cameras] == [0, 0]
    assert note.startswith("by the time in the names of the pictures ('front' from 0000_1698000017900000.png on")
    assert note.endswith("would be front=4 left=0; they are not taken: the numbers in the names pair frames")


@pytest.mark.parametrize("late", [0, 2])
def test_numbers_that_times_contradict_are_named_among_common_frames(room, late):
    names = {"front": numbered_and_timed(0, TIMES), "left": numbered_and_timed(5, TIMES[late:])}
    session, notes = noted(room, videos=folders(room, **names), fps=30.0, common_frames=True)
    assert [c.offset for c in session.cameras] == [5, 0]
    assert f"would be front={late} left=0; they are not taken: the numbers in the names pair frames" in notes[0]


@pytest.mark.parametrize("late", [0, 4])
@pytest.mark.parametrize("common", [False, True])
def test_times_pair_pictures_whose_numbers_have_none_in_common(room, late, common):
    names = {"front": numbered_and_timed(0, TIMES), "left": numbered_and_timed(700, TIMES[late:])}
    session, notes = noted(room, videos=folders(room, **names), fps=30.0, common_frames=common)
    assert [c.offset for c in session.cameras] == [late, 0]
    assert session.n_frames == 20 - late
    assert notes[0].startswith("the time in the names of the pictures of all cameras pairs frames")
    assert notes[0].endswith(f"offsets front={late} left=0")


def test_numbers_that_times_confirm_or_say_nothing_of(room):
    """The clocks of two machines may be hours apart: numbers of one trigger need no word on them."""
    names = {"front": numbered_and_timed(0, TIMES), "left": numbered_and_timed(4, TIMES[4:])}
    _, notes = noted(room, videos=folders(room, **names), fps=30.0, common_frames=True)
    assert not any("the numbers in the names" in note for note in notes)
    names = {"a/front": numbered_and_timed(0, TIMES), "a/left": numbered_and_timed(0, TIMES + 5000)}
    (room / "a").mkdir()
    _, notes = noted(room, folder=room / "t", videos=folders(room, **names), fps=30.0)
    assert notes == []


def test_creation_times_without_a_common_frame_are_named(room):
    videos = tagged(room, "creation_time", front="2026-01-02T03:04:05Z", left="2026-01-02T03:05:05Z")
    _, (note,) = noted(room, videos=videos)
    assert "would be front=1798.2 left=0; they are not taken: it is known to 30 frames only" in note


def test_clocks_that_are_not_taken_are_shown_later_too(room):
    made, (note,) = noted(
        room, videos=tagged(room, "creation_time", front="2026-01-02T03:04:05Z", left="2026-01-02T03:04:25Z")
    )
    assert "they are not taken" in note
    assert clocks_of_footage(made)[1] == [note]


def test_time_codes_of_two_forms(room):
    """Without drop frames a time code is no time of day: from the first minute on the two forms differ."""
    _, (note,) = noted(room, videos=tagged(room, front="00:00:10;00", left="00:00:10:05"))
    assert "they are not taken: it leaves out numbers (drop-frame) in some cameras only" in note
