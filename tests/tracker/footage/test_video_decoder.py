"""Random access by `VideoFile`: how many frames it decodes, how much it keeps, and that the order never matters."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from clips import SIZE, N, encode, write_images
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.footage import video_decoder
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording
from tracker.footage.video import VideoFile
from tracker.footage.video_decoder import FrameReader, VideoDecoder
from tracker.geometry.cameras import Camera

YUV_BYTES = (128 + 64) * SIZE[1]
"""Size of a frame as decoded: FFmpeg pads rows of 64 and 32 pixels to 128 and 64 bytes."""
CAMERA = Camera("cam", SIZE, np.array([[50.0, 0, 32], [0, 50, 24], [0, 0, 1]]), np.zeros(0), np.eye(4))
OPEN_GROUPS = {"x264-params": "open-gop=1:keyint=15:min-keyint=15:bframes=3:b-adapt=0:scenecut=0"}


@pytest.fixture
def decoded(monkeypatch):
    """The number of frames decoded so far, in a list."""
    count, decode = [0], VideoDecoder._decode

    def counted(decoder, packets):
        for frame in decode(decoder, packets):
            count[0] += 1
            yield frame

    monkeypatch.setattr(VideoDecoder, "_decode", counted)
    return count


def decoded_backward(video, decoded, step=1):
    decoded[0] = 0
    for k in range(N - 1, -1, -step):
        video.read(k)
    return decoded[0]


@pytest.mark.slow
@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("gop", [12, 60])
def test_a_group_is_decoded_once_on_the_way_back(tmp_path, decoded, gop, step):
    video = VideoFile(encode(tmp_path / "a.mp4", gop=gop), "cam")
    assert decoded_backward(video, decoded, step) <= N


def test_a_group_that_does_not_fit_is_decoded_in_parts(tmp_path, decoded):
    """With room for a third of the group, each of three passes decodes from the key frame on."""
    video = VideoFile(encode(tmp_path / "a.mp4", gop=N), "cam", passed_bytes=N // 3 * YUV_BYTES)
    third = N // 3 + 1  # the frame that is asked for is not kept
    assert decoded_backward(video, decoded) <= N + (N - third) + (N - 2 * third)


def test_the_cache_is_bounded_for_all_cameras_together(tmp_path, decoded, monkeypatch):
    monkeypatch.setattr(video_decoder, "MAX_PASSED_BYTES", 20 * YUV_BYTES)
    path = encode(tmp_path / "a.mp4", gop=N)
    with Recording([CameraSource(CAMERA, path)] * 2, cache_bytes=0) as recording:
        for k in range(N - 1, -1, -1):
            recording.read(k)
            kept = [footage._reader._passed for footage in recording._footage]
            assert all(len(p._frames) * YUV_BYTES == p.n_bytes <= 10 * YUV_BYTES for p in kept)
        assert decoded[0] < 2 * N * N / 2 / 5


@pytest.mark.parametrize(("gop", "chosen"), [(12, [0, 12, 36, 48]), (N, [0, 19, 39, N - 1])])
def test_quick_frames_are_key_frames_where_there_are_enough(tmp_path, decoded, gop, chosen):
    source = CameraSource(CAMERA, encode(tmp_path / "a.mp4", gop=gop, options={"x264-params": "scenecut=0"}))
    with Recording([source]) as recording:
        assert recording.quick_frames(4) == chosen
        decoded[0] = 0
        for k in recording.quick_frames(4):
            recording.read(k)
        assert decoded[0] == (4 if gop == 12 else N)
    with Recording([replace(source, offset=5)]) as recording:
        assert recording.quick_frames(3) == ([0, 19, 43] if gop == 12 else [0, 27, 54])
    images = CameraSource(CAMERA, write_images(tmp_path / "b", [f"{i}.png" for i in range(9)]))
    with Recording([images]) as recording:
        assert recording.quick_frames(3) == [0, 4, 8]
        assert recording.quick_frames(50) == list(range(9))


def test_frames_larger_than_the_bound_are_decoded_again(tmp_path):
    path = encode(tmp_path / "a.mp4")
    video, one = VideoFile(path, "cam", passed_bytes=1), VideoFile(path, "cam")
    for k in (30, 29, 28):
        np.testing.assert_array_equal(video.read(k), one.read(k))


def test_frames_shown_before_the_key_frame_are_not_kept(tmp_path):
    """They may refer to frames stored before it, which were not decoded."""
    path = encode(tmp_path / "a.mp4", gop=12)
    listed = VideoFile(path, "cam")._listed.frames
    reader = FrameReader(path, "cam", listed._replace(key_pts=listed.pts[[0, 15]]), 2**20)
    reader.read(reader._index, 17)  # the seek to frame 15 lands on frame 12
    assert [k for k in range(N) if reader._passed.get(int(listed.pts[k]))] == [15, 16]


@cache
def videos(folder):
    """A video of open groups with B-frames, and all its frames as decoded from start to end."""
    path = encode(folder / "a.mp4", options=OPEN_GROUPS)
    video = VideoFile(path, "cam")
    return path, [video.read(k) for k in range(N)]


@pytest.mark.slow
@given(order=st.lists(st.integers(0, N - 1), max_size=30), room=st.integers(0, 25))
@settings(max_examples=30)
def test_frames_do_not_depend_on_the_order(tmp_path_factory, order, room):
    path, frames = videos(tmp_path_factory.getbasetemp())
    video = VideoFile(path, "cam", passed_bytes=room * YUV_BYTES)
    for k in order:
        np.testing.assert_array_equal(video.read(k), frames[k])
    video.close()
