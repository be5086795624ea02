import random
import struct
from concurrent.futures import ThreadPoolExecutor

import av
import cv2
import numpy as np
import pytest
from clips import SIZE, N, encode, encode_stamped, number, picture, write_images

from tracker.errors import RecordingError
from tracker.footage.image_folder import ImageFolder, missing_numbers
from tracker.footage.picture_numbers import picture_numbers
from tracker.footage.video import VideoFile, open_footage
from tracker.footage.video_decoder import FrameReader


def decode_all(path):
    """What a decoder shows from start to end: the truth for every other order of access."""
    with av.open(str(path)) as container:
        return [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]


def assert_same_in_any_order(path, frames):
    video = VideoFile(path, "cam")
    assert video.n_frames == len(frames)
    rng = random.Random(1)
    forward = list(range(len(frames)))
    for order in (forward, forward[::-1], rng.sample(forward, len(frames)), [0, 0, 5, 5, 3, len(frames) - 1, 1]):
        for k in order:
            np.testing.assert_array_equal(video.read(k), frames[k], err_msg=f"frame {k}")
    video.close()


OPEN_GOP = {"x264-params": "open-gop=1:keyint=10:min-keyint=10:bframes=3:b-adapt=0:scenecut=0"}


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("short.mp4", {}),
        ("long.mp4", {"gop": 250}),
        ("pyramid.mp4", {"options": {"x264-params": "bframes=5:b-adapt=0:b-pyramid=normal:scenecut=0"}}),
        ("open.mp4", {"options": OPEN_GOP}),
        ("open.mkv", {"options": OPEN_GOP}),
        ("open.ts", {"options": OPEN_GOP}),
        ("intra.mp4", {"gop": 1, "bframes": 0}),
        ("a.mkv", {}),
        ("a.avi", {"codec": "mpeg4", "bframes": 0}),
        ("m.avi", {"codec": "mjpeg", "bframes": 0, "pix_fmt": "yuvj420p"}),
        ("a.mpg", {"codec": "mpeg2video", "bframes": 2}),
        ("a.webm", {"codec": "libvpx-vp9", "options": {"auto-alt-ref": "1", "lag-in-frames": "16"}}),
        ("h265.mp4", {"codec": "libx265", "options": {"x265-params": "keyint=15:bframes=4:open-gop=1:log-level=none"}}),
    ],
)
def test_every_order_of_access_is_bit_identical(tmp_path, name, settings):
    path = encode(tmp_path / name, **settings)
    frames = decode_all(path)
    assert len(frames) == N
    assert all(abs(number(f) - i) <= 1 for i, f in enumerate(frames))  # old codecs lose more than a gray level
    assert_same_in_any_order(path, frames)


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.avi"])
def test_random_access_does_not_start_from_the_beginning(tmp_path, name, monkeypatch):
    settings = {"codec": "mpeg4", "bframes": 0} if name == "a.avi" else {"options": OPEN_GOP}
    video = VideoFile(encode(tmp_path / name, **settings), "cam")
    monkeypatch.delattr(FrameReader, "_open")
    for k in (50, 33, 12, 59, 20):
        assert abs(number(video.read(k)) - k) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["mp4", "mkv"])
def test_video_cut_at_an_open_group(tmp_path, suffix):
    """Leading frames that need what has been cut away cannot be shown, and so are not counted."""
    whole, path = encode(tmp_path / "whole.mp4", options=OPEN_GOP), tmp_path / f"cut.{suffix}"
    with av.open(str(whole)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        n_keys = 0
        for packet in source.demux(video=0):
            n_keys += packet.is_keyframe
            if n_keys >= 2 and packet.size:
                packet.stream = stream
                target.mux(packet)
    frames = decode_all(path)
    assert [number(f) for f in frames] == list(range(10, N))
    assert_same_in_any_order(path, frames)


def with_edit(path, skip, ticks_per_frame=512, duration_ms=None):
    """Let the edit list of an MP4 begin `skip` frames later, in the middle of a group of pictures."""
    data = bytearray(path.read_bytes())
    at = data.find(b"elst") + 12
    duration, media_time = struct.unpack(">Ii", data[at : at + 8])
    data[at : at + 8] = struct.pack(">Ii", duration_ms or duration, media_time + skip * ticks_per_frame)
    path.write_bytes(data)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("skip", [1, 7, 12, 17])
def test_edit_lists(tmp_path, skip):
    path = with_edit(encode(tmp_path / "a.mp4"), skip)
    frames = decode_all(path)
    assert [number(f) for f in frames] == list(range(skip, N))
    assert_same_in_any_order(path, frames)


def test_edit_list_that_cuts_the_end(tmp_path):
    path = with_edit(encode(tmp_path / "a.mp4"), 5, duration_ms=1000)
    frames = decode_all(path)
    assert [number(f) for f in frames] == list(range(5, 35))
    assert_same_in_any_order(path, frames)


def test_video_that_starts_before_zero(tmp_path):
    path = encode(tmp_path / "a.mp4", start=-5)
    frames = decode_all(path)
    assert [number(f) for f in frames] == list(range(5, N))
    assert_same_in_any_order(path, frames)


@pytest.mark.slow
@pytest.mark.parametrize("rotation", [0, 90, 180, -90])
def test_display_rotation_turns_as_opencv_does(tmp_path, rotation):
    path = encode(tmp_path / "a.mp4", rotation=rotation)
    video = VideoFile(path, "cam")
    assert video.size == (SIZE if rotation % 180 == 0 else SIZE[::-1])
    image = video.read(9)
    assert image.shape[1::-1] == video.size
    reader = cv2.VideoCapture(str(path))
    for _ in range(10):
        _, bgr = reader.read()
    # The converters round differently: up to a few levels, where a wrong turn would differ by a hundred.
    assert np.abs(bgr[..., ::-1].astype(int) - image).mean() < 3


@pytest.mark.parametrize(
    "matrix",
    [
        (1, 0, 0, 1),
        (-1, 0, 0, 1),
        (1, 0, 0, -1),
        (-1, 0, 0, -1),
        (0, 1, 1, 0),
        (0, -1, -1, 0),
        (0, 1, -1, 0),
        (0, -1, 1, 0),
    ],
)
def test_display_matrix_moves_pixels_as_it_says(tmp_path, matrix):
    """Each pixel goes where the matrix maps it, mirrored or not."""
    exact = {"pix_fmt": "yuv444p", "options": {"qp": "0"}}
    video = VideoFile(encode(tmp_path / "a.mp4", n=4, matrix=matrix, **exact), "cam")
    a, b, c, d = matrix
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    to_x, to_y = a * x + c * y, b * x + d * y
    expected = np.zeros((np.ptp(to_y) + 1, np.ptp(to_x) + 1, 3), np.uint8)
    expected[to_y - to_y.min(), to_x - to_x.min()] = picture(3)
    assert video.size == expected.shape[1::-1]
    assert video.is_mirrored == (a * d - b * c < 0)
    assert np.abs(video.read(3).astype(int) - expected).mean() < 2


def test_facts_of_a_video(tmp_path):
    video = VideoFile(encode(tmp_path / "a.mp4", rate=50), "cam")
    assert (video.size, video.n_frames, video.fps, video.has_constant_rate) == (SIZE, N, 50.0, True)


@pytest.mark.parametrize("rate", [30, 60, 240])
def test_coarse_ticks_are_still_a_constant_rate(tmp_path, rate):
    video = VideoFile(encode(tmp_path / "a.mkv", rate=rate), "cam")
    assert video.has_constant_rate
    assert video.fps == pytest.approx(rate, rel=1e-6)


def test_variable_rate_is_noticed(tmp_path):
    times = [i + (i > 20) for i in range(N)]  # one dropped frame
    assert not VideoFile(encode(tmp_path / "a.mp4", times=times), "cam").has_constant_rate


@pytest.mark.slow
@pytest.mark.parametrize(("late", "jitter", "gaps"), [(0, 0.0, 0), (90, 0.0, 0), (0, 0.15, 0), (0, 0.0, 2)])
def test_start_jitter_and_gaps_of_time_stamps(tmp_path, late, jitter, gaps):
    times = 3000 * np.arange(N) + np.round(3000 * jitter * np.array([(-1) ** k for k in range(N)])).astype(int)
    for k in range(gaps):
        times[20 * (k + 1) :] += 3000
    video = VideoFile(encode_stamped(tmp_path / "a.mp4", (times - times[0] + late * 1000).tolist()), "cam")
    assert video.stamps.start_s == pytest.approx(late / 90)
    assert video.stamps.n_gaps == gaps
    if not gaps:
        assert video.stamps.jitter == pytest.approx(jitter, abs=0.01)


def test_many_threads_get_the_right_frames(tmp_path):
    video = VideoFile(encode(tmp_path / "a.mp4"), "cam")
    wrong = []

    def work(seed):
        for k in random.Random(seed).choices(range(N), k=40):
            if number(video.read(k)) != k:
                wrong.append(k)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    assert wrong == []


@pytest.mark.parametrize("k", [-1, N])
def test_out_of_range_names_the_range(tmp_path, k):
    with pytest.raises(RecordingError, match=rf"from 0 to {N - 1}, found {k}"):
        VideoFile(encode(tmp_path / "a.mp4"), "cam").read(k)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("a.mp4", {}),
        ("fast.mp4", {"container_options": {"movflags": "faststart"}}),
        ("a.mkv", {}),
        ("a.avi", {"codec": "mpeg4", "bframes": 0}),
    ],
)
def test_truncated_video(tmp_path, name, settings):
    path = encode(tmp_path / name, **settings)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.6)])
    with pytest.raises(RecordingError, match=r"camera 'cam'.*truncated"):
        VideoFile(path, "cam")


@pytest.mark.parametrize("kept", [0.0, 0.5])
def test_damaged_frame_does_not_take_the_others_with_it(tmp_path, kept):
    path = encode(tmp_path / "a.mp4", gop=1, bframes=0)
    frames = decode_all(path)
    with av.open(str(path)) as container:
        packet = next(p for i, p in enumerate(container.demux(video=0)) if i == 30)
        position, size = packet.pos, packet.size
    data = bytearray(path.read_bytes())
    data[position + int(kept * size) : position + size] = bytes(size - int(kept * size))
    path.write_bytes(data)
    video = VideoFile(path, "cam")
    assert video.n_frames == N
    for k in (30, 29, 30, 31, 59):
        if k == 30:
            assert video.read(k) is None
        else:
            np.testing.assert_array_equal(video.read(k), frames[k])


def test_not_a_video(tmp_path):
    (tmp_path / "a.mp4").write_text("hello")
    with pytest.raises(RecordingError, match=r"camera 'cam'.*cannot be read"):
        VideoFile(tmp_path / "a.mp4", "cam")


def test_missing_video(tmp_path):
    with pytest.raises(RecordingError, match=r"camera 'cam'.*not found"):
        open_footage(tmp_path / "a.mp4", "cam")


def test_sound_alone(tmp_path):
    with av.open(str(tmp_path / "a.mp4"), "w") as container:
        stream = container.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(RecordingError, match="without a video stream"):
        VideoFile(tmp_path / "a.mp4", "cam")


def test_no_time_stamps(tmp_path):
    path = encode(tmp_path / "a.h264", n=1)
    with pytest.raises(RecordingError, match="time stamps"):
        VideoFile(path, "cam")


def test_time_stamps_out_of_order(tmp_path):
    # H.264 with B-frames, whose order AVI cannot keep.
    path = encode(tmp_path / "a.avi", gop=250, options={"x264-params": "bframes=3:b-adapt=2:b-pyramid=none"})
    with pytest.raises(RecordingError, match="AVI files with B-frames"):
        VideoFile(path, "cam")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cam01", "cam02", "cam03", "cam04"])
def test_real_footage(data_folder, name):
    video = VideoFile(data_folder("balance_real") / f"{name}.mp4", name)
    assert (video.n_frames, video.fps, video.has_constant_rate) == (100, 60.0, True)
    first = {k: video.read(k) for k in (99, 40, 41, 3)}
    for k in (3, 40, 99):
        np.testing.assert_array_equal(video.read(k), first[k])


@pytest.mark.parametrize("suffix", ["png", "bmp", "tif"])
def test_images_in_natural_order(tmp_path, suffix):
    folder = write_images(tmp_path / "f", [f"f{i}.{suffix}" for i in range(12)])
    (folder / "notes.txt").write_text("not a frame")
    images = open_footage(folder, "cam")
    assert isinstance(images, ImageFolder)
    assert (images.n_frames, images.size, images.fps) == (12, SIZE, None)
    assert [number(images.read(k)) for k in (11, 0, 2, 10)] == [11, 0, 2, 10]
    assert images.read(5)[0, 0].tolist() == [20, 20, 5]  # RGB


@pytest.mark.parametrize(
    ("stems", "numbers", "missing"),
    [
        (["f1", "f2", "f10"], (1, 2, 10), [3, 4, 5, 6, 7]),
        (["cam2_take3_0008", "cam2_take3_0009"], (8, 9), []),
        (["a00", "a02", "a04", "a08"], (0, 2, 4, 8), [6]),  # every other frame was kept
        (["17-03-11", "17-04-02", "18-04-59"], None, []),  # names of times
        (["1698000017", "1698000054", "1698000083", "1698000125"], None, []),
        (["a", "b"], None, []),
    ],
)
def test_numbers_of_images(stems, numbers, missing):
    assert picture_numbers(stems).numbers == numbers
    assert missing_numbers(numbers or (1,)) == missing


def test_images_in_the_order_of_the_number_that_runs(tmp_path):
    names = [f"{i}_{k:04d}.png" for k, i in enumerate([7, 913, 55, 128, 6, 3001, 2])]
    images = ImageFolder(write_images(tmp_path / "f", names), "cam")
    assert [f.name for f in images.files] == names
    assert images.numbers == tuple(range(7))
    assert ImageFolder(write_images(tmp_path / "g", ["img5.png"]), "cam").numbers is None


def test_image_folder_out_of_range(tmp_path):
    with pytest.raises(RecordingError, match="from 0 to 1, found 2"):
        ImageFolder(write_images(tmp_path / "f", ["1.png", "2.png"]), "cam").read(2)


def test_empty_image_folder(tmp_path):
    with pytest.raises(RecordingError, match=r"camera 'cam'.*found none"):
        ImageFolder(write_images(tmp_path / "f", []), "cam")


def test_images_of_two_kinds(tmp_path):
    with pytest.raises(RecordingError, match=r"found \.jpg and \.png"):
        ImageFolder(write_images(tmp_path / "f", ["1.png", "2.jpg"]), "cam")


def test_images_of_two_sizes(tmp_path):
    folder = write_images(tmp_path / "f", ["1.png"])
    cv2.imwrite(str(folder / "2.png"), np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(RecordingError, match=r"64x48.*10x10 in 2\.png"):
        ImageFolder(folder, "cam").read(1)


def test_damaged_image(tmp_path):
    folder = write_images(tmp_path / "f", ["1.png"])
    (folder / "2.png").write_bytes(b"")
    assert ImageFolder(folder, "cam").read(1) is None
    (folder / "1.png").write_bytes(b"not an image")
    with pytest.raises(RecordingError, match=r"1\.png is damaged"):
        ImageFolder(folder, "cam")
