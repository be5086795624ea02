import random
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest
from clips import SIZE, encode, number, picture, write_images

from tracker.errors import RecordingError
from tracker.footage.camera_source import CameraSource, Clock
from tracker.footage.recording import Recording, read_background, read_mask
from tracker.formats.anipose import read_calibration
from tracker.geometry.cameras import Camera

K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
FRAME_BYTES = SIZE[0] * SIZE[1] * 3


def source(name, footage, size=SIZE, **more):
    return CameraSource(Camera(name, size, K, np.zeros(0), np.eye(4)), footage, **more)


@pytest.fixture
def two(tmp_path):
    """A video and a folder of images, of which the second began three frames earlier."""
    video = encode(tmp_path / "a.mp4", n=20)
    images = write_images(tmp_path / "b", [f"{i}.png" for i in range(23)])
    return source("a", video), source("b", images, offset=3)


def test_frame_k_of_every_camera(two):
    with Recording(two) as recording:
        assert (recording.n_frames, recording.fps) == (20, 30.0)
        for k in (0, 19, 7, 7, 6):
            a, b = recording.read(k)
            assert (number(a), number(b)) == (k, k + 3)


def test_range_is_what_all_cameras_have(two):
    recording = Recording(two)
    for k in (-1, 20):
        with pytest.raises(RecordingError, match=f"from 0 to 19, found {k}"):
            recording.read(k)


def test_an_offset_beyond_the_footage_is_named(tmp_path):
    late = source("a", encode(tmp_path / "a.mp4", n=20), offset=10_000_000)
    with pytest.raises(RecordingError, match="'a': expected an offset below its 20 frames, found 10000000"):
        Recording([late])


def test_frames_cannot_be_written(two):
    with pytest.raises(ValueError):
        Recording(two).read(0)[0][:] = 0


@pytest.mark.parametrize("frames", [0, 1, 6])
def test_cache_is_bounded_and_keeps_the_latest(two, frames):
    recording = Recording(two, cache_bytes=frames * FRAME_BYTES)
    for k in range(20):
        recording.read(k)
        assert sum(map(recording.cached, range(20))) == min(k + 1, frames // 2)
    assert [k for k in range(20) if recording.cached(k)] == list(range(20 - frames // 2, 20))


def test_frame_used_last_stays_longest(two):
    recording = Recording(two, cache_bytes=6 * FRAME_BYTES)
    for k in (0, 1, 2, 0, 3):
        recording.read(k)
    assert [k for k in range(20) if recording.cached(k)] == [0, 2, 3]


def test_offset_takes_frames_from_the_end(two):
    assert Recording([two[0], source("b", two[1].footage, offset=8)]).n_frames == 15


def test_cached_frame_is_the_same_array(two):
    recording = Recording(two)
    assert recording.read(4)[0] is recording.read(4)[0]


def test_many_threads(two):
    recording = Recording(two, cache_bytes=5 * FRAME_BYTES)
    wrong = []

    def work(seed):
        for k in random.Random(seed).choices(range(20), k=60):
            a, b = recording.read(k)
            if (number(a), number(b)) != (k, k + 3):
                wrong.append(k)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    assert wrong == []


def test_damaged_frame_is_none_for_its_camera_alone(two):
    (two[1].footage / "8.png").write_bytes(b"broken")
    a, b = Recording(two).read(5)
    assert number(a) == 5
    assert b is None


def test_size_unlike_the_calibration(tmp_path):
    video = encode(tmp_path / "a.mp4", n=5)
    with pytest.raises(RecordingError, match=r"camera 'left'.*100x50.*64x48"):
        Recording([source("left", video, size=(100, 50))])
    with pytest.raises(RecordingError, match="may be rotated"):
        Recording([source("left", video, size=SIZE[::-1])])


def test_background_from_an_image(tmp_path):
    cv2.imwrite(str(tmp_path / "bg.png"), np.full((SIZE[1], SIZE[0], 3), (10, 20, 30), np.uint8))
    image = read_background(source("a", tmp_path, background=tmp_path / "bg.png"))
    assert image.shape == (SIZE[1], SIZE[0], 3)
    assert image[0, 0].tolist() == [30, 20, 10]


def test_background_from_a_video_is_its_mean(tmp_path):
    video = encode(tmp_path / "bg.mp4", n=21)
    image = read_background(source("a", tmp_path, background=video))
    # The gray centre runs from 0 to 80: its mean is 40, which is picture 10.
    assert number(image) == number(picture(10)) == 10


def test_no_background(tmp_path):
    assert read_background(source("a", tmp_path)) is None


def test_background_of_another_size(tmp_path):
    cv2.imwrite(str(tmp_path / "bg.png"), np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(RecordingError, match="10x10"):
        read_background(source("a", tmp_path, background=tmp_path / "bg.png"))


def test_missing_background(tmp_path):
    for name in ("bg.png", "bg.mp4"):
        with pytest.raises(RecordingError, match=r"camera 'a'"):
            read_background(source("a", tmp_path, background=tmp_path / name))


def test_masks_are_named_by_video_frame(tmp_path):
    mask = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    mask[3, 4] = 2
    cv2.imwrite(str(tmp_path / "000007.png"), mask)
    camera = source("a", tmp_path, masks=tmp_path, offset=3)
    np.testing.assert_array_equal(read_mask(camera, 4), mask)
    assert read_mask(camera, 5) is None
    assert read_mask(source("a", tmp_path), 4) is None


@pytest.mark.parametrize(
    ("mask", "expected"),
    [
        (np.zeros((SIZE[1], SIZE[0], 3), np.uint8), "uint8 with 3 channels"),
        (np.zeros((SIZE[1], SIZE[0]), np.uint16), "uint16"),
        (np.zeros((5, 5), np.uint8), "5x5"),
    ],
)
def test_malformed_masks(tmp_path, mask, expected):
    cv2.imwrite(str(tmp_path / "000000.png"), mask)
    with pytest.raises(RecordingError, match=expected):
        read_mask(source("a", tmp_path, masks=tmp_path), 0)


@pytest.mark.slow
def test_real_footage(data_folder):
    folder = data_folder("balance_real")
    cameras = [
        CameraSource(c, folder / f"{c.name}.mp4", folder / "background" / f"{c.name}.png")
        for c in read_calibration(folder / "Calib.toml")
    ]
    with Recording(cameras) as recording:
        assert (recording.n_frames, recording.fps) == (100, 60.0)
        images = recording.read(50)
    for camera, image in zip(cameras, images, strict=True):
        background = read_background(camera)
        assert image.shape == background.shape == (camera.camera.height, camera.camera.width, 3)
        # Mostly the same room.
        assert np.median(np.abs(background.astype(int) - image)) < 20


def test_the_nearest_picture_is_at_most_half_a_frame_away():
    for clock in (Clock(), Clock(0.5), Clock(-0.4), Clock(2.3), Clock(-1.7, 0.02)):
        for k in range(3, 30):
            shown = clock.nearest(k, 40)
            assert abs(shown + clock.offset_frames(shown) - k) <= 0.52
    assert [Clock(0.5).nearest(k, 9) for k in range(9)] == [*range(9)]
    assert Clock(2.0).nearest(1, 9) == 0
    assert Clock(-2.0).nearest(8, 9) == 8
