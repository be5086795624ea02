"""Images are measured before they are decoded."""

import os
import struct
import zlib

import cv2
import numpy as np
import pytest
from clips import encode

from tracker.errors import RecordingError
from tracker.footage import image_file, video_decoder
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import decode_image, read_image, read_image_or_none, read_label_image, read_unchanged
from tracker.footage.image_folder import ImageFolder
from tracker.footage.proxy import Proxy
from tracker.footage.recording import read_background, read_mask
from tracker.footage.video import VideoFile
from tracker.geometry.cameras import Camera

SUFFIXES = [".png", ".jpg", ".bmp", ".tif"]


def bomb(width, height):
    """A PNG that promises many pixels: a header, and data for some of them."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(1000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.fixture
def never_decoded(monkeypatch):
    def decode(*_):
        raise AssertionError("decoded")

    monkeypatch.setattr(cv2, "imdecode", decode)


@pytest.mark.parametrize("size", [(32000, 32000), (10000, 9000), (2**31 - 1, 2**31 - 1), (80_000_001, 1)])
def test_an_image_bomb_is_refused_by_its_header(tmp_path, never_decoded, size):
    path = tmp_path / "000000.png"
    path.write_bytes(bomb(*size))
    K = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
    camera = CameraSource(Camera("cam", size, K, np.zeros(0), np.eye(4)), tmp_path, background=path, masks=tmp_path)
    for read in (
        lambda: read_image(path, "here"), lambda: read_unchanged(path, "here"), lambda: ImageFolder(tmp_path, "cam"),
        lambda: read_background(camera), lambda: read_mask(camera, 0), lambda: read_label_image(path, "here"),
    ):  # fmt: skip
        with pytest.raises(RecordingError, match="expected at most 80 million pixels, found"):
            read()


def test_a_bomb_among_images_and_in_a_proxy_is_refused(tmp_path):
    (tmp_path / "f").mkdir()
    cv2.imwrite(str(tmp_path / "f" / "1.png"), np.zeros((48, 64, 3), np.uint8))
    (tmp_path / "f" / "2.png").write_bytes(bomb(32000, 32000))
    with pytest.raises(RecordingError, match=r"2\.png: expected at most 80 million pixels"):
        ImageFolder(tmp_path / "f", "cam").read(1)
    (tmp_path / "cam.mjpeg").write_bytes(data := bomb(32000, 32000))
    (tmp_path / "cam.index").write_bytes(struct.pack("<Q", len(data)))
    with pytest.raises(RecordingError, match=r"cam\.mjpeg: expected at most 80 million pixels"):
        Proxy(tmp_path, "cam").read(0)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("size", [(640, 480), (64, 48)])
def test_images_at_the_limit_are_read_and_larger_ones_are_not(tmp_path, monkeypatch, suffix, size):
    monkeypatch.setattr(image_file, "MAX_PIXELS", 64 * 48)
    path = tmp_path / f"a{suffix}"
    cv2.imwrite(str(path), np.full((size[1], size[0], 3), 7, np.uint8))
    if size == (64, 48):
        assert read_image(path, "here").shape == (48, 64, 3)
    else:
        with pytest.raises(RecordingError, match=f"found {size[0]}x{size[1]}"):
            read_image(path, "here")


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_all_depths_and_channels_are_read(tmp_path, suffix, channels, depth):
    shape = (48, 64) if channels == 1 else (48, 64, channels)
    cv2.imwrite(str(tmp_path / f"a{suffix}"), np.full(shape, 200, depth))
    assert read_image(tmp_path / f"a{suffix}", "here").shape == (48, 64, 3)
    assert read_unchanged(tmp_path / f"a{suffix}", "here").dtype == depth


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_damaged_images_are_none_and_never_raise(tmp_path, suffix):
    whole = cv2.imencode(suffix, np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8))[1].tobytes()
    rng = np.random.default_rng(1)
    for _ in range(60):
        data = bytearray(whole[: rng.integers(0, len(whole))] if rng.random() < 0.5 else whole)
        for _ in range(rng.integers(0, 6)):
            if data:
                data[rng.integers(0, min(len(data), 200))] = rng.integers(0, 256)
        try:
            image = decode_image(bytes(data), "here")
        except RecordingError:
            continue
        assert image is None or image.dtype == np.uint8


def test_an_irregular_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    with pytest.raises(RecordingError, match="expected a file"):
        read_image_or_none(tmp_path / "a.png", "here")


def test_a_file_larger_than_any_image_is_not_read(tmp_path):
    with (tmp_path / "a.png").open("wb") as file:
        file.truncate(10**10)
    with pytest.raises(RecordingError, match="at most 640 MB, found 10000 MB"):
        read_image(tmp_path / "a.png", "here")


def test_a_video_with_too_many_pixels_is_refused(tmp_path, monkeypatch):
    path = encode(tmp_path / "a.mp4", n=3)
    VideoFile(path, "cam").close()
    monkeypatch.setattr(image_file, "MAX_PIXELS", 1000)
    with pytest.raises(RecordingError, match="found 64x48"):
        VideoFile(path, "cam")


def test_a_stream_with_more_pixels_than_its_header_is_refused(tmp_path, monkeypatch):
    """The header is one thing; the decoder has the limit as well."""
    path = encode(tmp_path / "a.mp4", n=3)
    monkeypatch.setattr(video_decoder, "_OPTIONS", {"max_pixels": "1000"})
    with pytest.raises(RecordingError, match="cannot be read"):
        VideoFile(path, "cam")
