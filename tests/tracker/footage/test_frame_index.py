"""The list of a video's frames, kept between openings."""

import os
from contextlib import closing

import numpy as np
import pytest
from clips import N, encode, number
from damaged_arrays import encrypted

from tracker.footage.video import VideoFile


@pytest.fixture
def clip(tmp_path):
    return encode(tmp_path / "cam.mp4", gop=12, bframes=3)


@pytest.fixture
def listed(monkeypatch):
    """How often the packets of a video have been listed."""
    calls = []
    real = VideoFile._list
    monkeypatch.setattr(VideoFile, "_list", lambda self, report=None: calls.append(self.path) or real(self, report))
    return calls


def frames(path, folder):
    with closing(VideoFile(path, "cam", folder)) as video:
        return [video.read(k) for k in (0, 31, 5, N - 1)]


def test_a_video_is_listed_once_and_its_frames_stay_the_same(clip, tmp_path, listed):
    first = frames(clip, tmp_path / "kept")
    again = frames(clip, tmp_path / "kept")
    assert len(listed) == 1
    assert [number(i) for i in again] == [0, 31, 5, N - 1]
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_nothing_is_kept_unless_asked_for(clip, tmp_path, listed):
    frames(clip, None)
    frames(clip, None)
    assert len(listed) == 2
    assert [p.name for p in tmp_path.iterdir()] == ["cam.mp4"]


def test_a_video_that_was_changed_is_listed_again(clip, tmp_path, listed):
    frames(clip, tmp_path / "kept")
    encode(clip, n=N, gop=5, bframes=0)
    assert [number(i) for i in frames(clip, tmp_path / "kept")] == [0, 31, 5, N - 1]
    stat = clip.stat()
    os.utime(clip, ns=(stat.st_atime_ns, stat.st_mtime_ns + 10**9))  # the same size, another time
    frames(clip, tmp_path / "kept")
    assert len(listed) == 3


@pytest.mark.slow
@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 half a file", b"nothing of the kind", encrypted])
def test_a_damaged_list_is_made_again(clip, tmp_path, listed, damage):
    frames(clip, tmp_path / "kept")
    (kept,) = (tmp_path / "kept").iterdir()
    kept.write_bytes(damage(kept.read_bytes()) if callable(damage) else damage)
    assert [number(i) for i in frames(clip, tmp_path / "kept")] == [0, 31, 5, N - 1]
    assert len(listed) == 2


def test_a_folder_that_cannot_be_written_does_no_harm(clip, tmp_path, listed):
    (tmp_path / "kept").write_text("a file in its place")
    assert [number(i) for i in frames(clip, tmp_path / "kept")] == [0, 31, 5, N - 1]
