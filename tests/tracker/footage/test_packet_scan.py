"""The frames of a video, listed beside: what is read meanwhile is what it would be otherwise."""

import threading
from contextlib import closing

import numpy as np
import pytest
from clips import encode

from tracker.errors import RecordingError
from tracker.footage import packet_scan
from tracker.footage.video import VideoFile


@pytest.fixture
def in_steps(monkeypatch):
    """Lets a listing go on a few packets at a time: `step()` lets the next report through."""
    monkeypatch.setattr(packet_scan, "_EVERY_PACKETS", 20)
    gate, real = threading.Semaphore(0), VideoFile._grow

    def grow(self, listed):
        gate.acquire(timeout=20)
        real(self, listed)

    monkeypatch.setattr(VideoFile, "_grow", grow)
    return gate.release


def whole(path):
    with closing(VideoFile(path, "cam")) as video:
        return [video.read(k) for k in range(video.n_frames)]


@pytest.mark.parametrize("b_frames", [0, 3])
def test_frames_listed_so_far_are_those_that_they_will_be(tmp_path, in_steps, b_frames):
    path = encode(tmp_path / "a.mp4", n=90, gop=12, bframes=b_frames)
    truth = whole(path)
    video = VideoFile(path, "cam", in_background=True)
    assert (video.n_frames, video.listed_share) == (0, 0.0)
    in_steps()
    np.testing.assert_array_equal(video.read(9), truth[9])
    so_far = video.n_frames
    assert 9 < so_far < 90
    assert 0 < video.listed_share < 1
    last = so_far - 1
    np.testing.assert_array_equal(video.read(last), truth[last])
    np.testing.assert_array_equal(video.read(3), truth[3])
    for _ in range(10):
        in_steps()
    np.testing.assert_array_equal(video.read(89), truth[89])
    np.testing.assert_array_equal(video.read(last + 1), truth[last + 1])
    assert (video.n_frames, video.listed_share) == (90, None)
    with pytest.raises(RecordingError, match="0 to 89, found 90"):
        video.read(90)
    video.close()


def test_a_waiting_reader_gets_the_frame_or_the_end(tmp_path, in_steps):
    video = VideoFile(encode(tmp_path / "a.mp4", n=90, gop=12), "cam", in_background=True)
    found = []

    def read():
        try:
            found.append(video.read(80))
        except RecordingError as error:
            found.append(str(error))

    reader = threading.Thread(target=read)
    reader.start()
    in_steps()
    reader.join(0.2)
    assert reader.is_alive()
    video.close()
    reader.join(5)
    assert "has been closed" in found[0]
    in_steps()


def test_a_faulty_file_is_named_though_late(tmp_path):
    path = encode(tmp_path / "a.mkv", n=90, gop=12)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(RecordingError, match="truncated"):
        VideoFile(path, "cam")
    with closing(VideoFile(path, "cam", in_background=True)) as video:
        with pytest.raises(RecordingError, match="truncated"):
            video.read(80)
        with pytest.raises(RecordingError, match="truncated"):
            _ = video.listed_share


def test_the_list_is_kept_for_the_next_opening(tmp_path):
    path = encode(tmp_path / "a.mp4", n=60, gop=12)
    with closing(VideoFile(path, "cam", tmp_path / "lists", in_background=True)) as video:
        assert video.read(59) is not None
    with closing(VideoFile(path, "cam", tmp_path / "lists", in_background=True)) as again:
        assert (again.n_frames, again.listed_share) == (60, None)
