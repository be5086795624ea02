"""Footage that is truncated, replaced or removed while it is open."""

import shutil
import subprocess
import sys

import av
import numpy as np
import pytest
from clips import SIZE, N, encode, number, write_images

from tracker.errors import RecordingError
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_folder import ImageFolder
from tracker.footage.recording import Recording, read_mask
from tracker.footage.video import VideoFile
from tracker.footage.video_decoder import VideoDecoder
from tracker.geometry.cameras import Camera


@pytest.fixture
def clip(tmp_path):
    return encode(tmp_path / "a.mp4")


@pytest.fixture
def video(clip):
    video = VideoFile(clip, "cam")
    yield video
    video.close()


def cut(path, share):
    with path.open("r+b") as file:
        file.truncate(int(path.stat().st_size * share))


@pytest.mark.slow
def test_nothing_is_read_from_a_closed_container(clip):
    """In a process of its own: libav would read a null pointer."""
    words = "import sys; from pathlib import Path; from tracker.footage.video_decoder import VideoDecoder;"
    words += "d = VideoDecoder(Path(sys.argv[1]), 'x'); f = d.frames; next(f); d.close(); print(next(f, 'end'))"
    done = subprocess.run([sys.executable, "-c", words, str(clip)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "end"), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_video_is_an_error_until_it_is_back(clip, video, share):
    whole = clip.read_bytes()
    assert abs(number(video.read(30)) - 30) <= 1
    cut(clip, share)
    for k in (50, 0, 31, 5, 59):
        with pytest.raises(RecordingError, match=r"camera 'cam'.*(cannot be read|truncated)"):
            video.read(k)
    clip.write_bytes(whole)
    for k in (50, 0, 31, 5, 59):
        assert abs(number(video.read(k)) - k) <= 1


def test_a_removed_video_is_an_error_until_it_is_back(clip, video, tmp_path):
    video.read(30)
    clip.rename(tmp_path / "elsewhere.mp4")
    for k in (31, 50, 0):
        with pytest.raises(RecordingError, match="is not there any more; put it back"):
            video.read(k)
    (tmp_path / "elsewhere.mp4").rename(clip)
    assert abs(number(video.read(31)) - 31) <= 1
    assert video.version == 0  # the same file


@pytest.mark.slow
@pytest.mark.parametrize("in_place", [False, True])
def test_a_video_replaced_by_one_of_the_same_frames_is_read_anew(clip, video, tmp_path, in_place):
    video.read(30)
    other = encode(tmp_path / "b.mp4", gop=5, bframes=0)
    shutil.copyfile(other, clip) if in_place else other.replace(clip)
    fresh = VideoFile(clip, "cam")
    for k in (31, 5, 59):
        np.testing.assert_array_equal(video.read(k), fresh.read(k))
    assert video.version == 1


def test_a_video_replaced_by_one_of_the_same_length_in_bytes_is_noticed(clip, video):
    video.read(30)
    data = clip.read_bytes()
    middle = len(data) // 2
    clip.write_bytes(data[: middle - 200] + bytes(400) + data[middle + 200 :])
    assert clip.stat().st_size == len(data)
    video.read(0)
    assert video.version == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "found"),
    [({"n": N - 10}, "found 50;"), ({"n": N + 10}, "found 70;"), ({"times": [2 * i for i in range(N)]}, "time stamps")],
)
def test_a_video_replaced_by_another_says_so_until_the_former_is_back(clip, video, tmp_path, settings, found):
    video.read(30)
    clip.rename(tmp_path / "former.mp4")
    encode(clip, **settings)
    for k in (0, 31):
        with pytest.raises(RecordingError, match=f"has changed: expected the 60 frames of before.*{found}"):
            video.read(k)
    (tmp_path / "former.mp4").replace(clip)
    assert abs(number(video.read(31)) - 31) <= 1


def test_a_video_replaced_by_one_of_another_size_says_so(clip, video):
    with av.open(str(clip), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 32, 32, "yuv420p"
        for i in range(N):
            frame = av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")
            frame.pts = i
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(RecordingError, match="expected 64x48 pixels as before, found 32x32"):
        video.read(3)


def test_an_unusable_version_is_listed_once(clip, video, monkeypatch):
    cut(clip, 0.5)
    opened, real = [], VideoDecoder.__init__
    monkeypatch.setattr(VideoDecoder, "__init__", lambda self, *args: opened.append(1) or real(self, *args))
    for k in range(20):
        with pytest.raises(RecordingError):
            video.read(k)
    assert len(opened) == 1


def test_a_video_that_was_damaged_while_it_was_listed_recovers(clip):
    whole = clip.read_bytes()
    video = VideoFile(clip, "cam", in_background=True)
    cut(clip, 0.4)
    with pytest.raises(RecordingError):
        video.read(50)
    clip.write_bytes(whole)
    assert abs(number(video.read(50)) - 50) <= 1
    assert (video.listed_share, video.n_frames) == (None, N)
    video.close()


def source(footage, **more):
    K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
    return CameraSource(Camera("cam", SIZE, K, np.zeros(0), np.eye(4)), footage, **more)


def test_frames_of_a_former_version_are_not_shown(clip, tmp_path):
    with Recording([source(clip)]) as recording:
        before = recording.read(7)[0]
        encode(clip, gop=1, bframes=0, options={"crf": "45"})
        recording.read(8)
        assert recording.version(0) == 1
        assert not np.array_equal(recording.read(7)[0], before)


def test_problems_are_named_until_they_are_solved(clip, tmp_path):
    images = write_images(tmp_path / "f", ["1.png", "2.png"])
    with Recording([source(clip), source(images)]) as recording:
        assert recording.problems() == []
        images.rename(tmp_path / "g")
        clip.rename(tmp_path / "b.mp4")
        assert [p.partition(";")[0].rpartition(" is ")[2] for p in recording.problems()] == ["not there any more"] * 2
        (tmp_path / "g").rename(images)
        (tmp_path / "b.mp4").rename(clip)
        assert recording.problems() == []


def test_an_image_that_is_gone_is_an_error_until_it_is_back(tmp_path):
    images = ImageFolder(write_images(tmp_path / "f", ["1.png", "2.png"]), "cam")
    (images.path / "2.png").rename(tmp_path / "2.png")
    with pytest.raises(RecordingError, match=r"2\.png: No such file"):
        images.read(1)
    (tmp_path / "2.png").rename(images.path / "2.png")
    assert number(images.read(1)) == 1
    images.path.rename(tmp_path / "g")
    with pytest.raises(RecordingError, match=r"image folder .* is not there any more"):
        images.read(1)


def test_masks_that_are_gone_are_an_error(tmp_path):
    camera = source(tmp_path, masks=tmp_path / "masks")
    with pytest.raises(RecordingError, match="folder of masks"):
        read_mask(camera, 0)
