"""Footage is paired by the clocks in files and names, or it is named why not."""

import numpy as np
import pytest
from clips import write_images
from new_sessions import assert_refused, new, noted, room

from tracker.errors import RecordingError, Remedy
from tracker.footage.camera_source import LostFrames
from tracker.footage.recording import Recording

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
        taken = [(k + camera.clock.ahead(k)) / 30 for k in range(session.n_frames)]
        assert taken == pytest.approx(shown - left[0], abs=1e-3)
    assert "paired by the times in the names" in notes[0]
    lost = (("front", 5), ("left", 11))
    assert notes[1:] == [f"camera '{c}' lost 1 frames by it, the first before its frame {k}" for c, k in lost]


def test_times_pair_pictures_of_a_camera_that_began_later(room):
    videos = folders(room, front=seconds_and_microseconds(TIMES), left=seconds_and_microseconds(TIMES[4:] + 0.003))
    session, _ = noted(room, videos=videos, fps=30.0)
    assert [c.offset for c in session.cameras] == [4, 0]
    assert session.n_frames == 16
    assert session.cameras[0].clock.ahead_frames == pytest.approx(-0.09, abs=0.001)
    with Recording(session.cameras) as recording:
        assert [int(image[0, 0, 1]) for image in recording.read(0)] == [16, 0]


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


def test_equal_names_need_no_reading(room):
    names = [f"14253{k // 9}_{k % 9}" for k in range(20)]
    assert new(room, videos=folders(room, front=names, left=names), fps=30.0).n_frames == 20
