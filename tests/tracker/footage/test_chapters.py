"""Files of one recording that follow one another, read as one video."""

import numpy as np
import pytest
from clips import encode, number, write_images

from tracker.errors import RecordingError
from tracker.footage.chapters import ChapteredVideo, chapter_files, next_chapter
from tracker.footage.recording import Recording
from tracker.footage.video import VideoFile, open_footage


def chapters(folder, lengths=(7, 13, 5), names=("GX010042.MP4", "GX020042.MP4", "GX030042.MP4"), **options):
    folder.mkdir()
    first = 0
    for name, n in zip(names, lengths, strict=True):
        encode(folder / name, n=n, gop=4, first=first, **options)
        first += n
    return folder


def test_frame_k_of_several_files(tmp_path):
    whole = encode(tmp_path / "whole.mp4", n=25)
    one, joined = VideoFile(whole, "cam"), open_footage(chapters(tmp_path / "cam"), "cam")
    assert isinstance(joined, ChapteredVideo)
    assert (joined.n_frames, joined.size, joined.fps) == (25, one.size, 30.0)
    keys = [VideoFile(c.path, "cam").key_frames + first for c, first in zip(joined.chapters, (0, 7, 20), strict=True)]
    assert joined.key_frames.tolist() == np.concatenate(keys).tolist()
    assert (joined.has_constant_rate, joined.stamps.n_gaps, joined.is_mirrored, joined.version) == (True, 0, False, 0)
    order = np.random.default_rng(0).permutation(25)
    assert [number(joined.read(int(k))) for k in order] == order.tolist()
    first = {k: joined.read(k) for k in (6, 7, 19, 20, 24)}
    for k in (24, 7, 20, 6, 19):
        np.testing.assert_array_equal(joined.read(k), first[k])
    for k in (-1, 25):
        with pytest.raises(RecordingError, match=f"expected a frame from 0 to 24, found {k}"):
            joined.read(k)
    joined.close()


def test_chapters_that_are_listed_in_the_background(tmp_path):
    with_list = open_footage(chapters(tmp_path / "cam"), "cam", in_background=True)
    assert number(with_list.read(24)) == 24  # waits
    assert (with_list.listed_share, with_list.n_frames) == (None, 25)
    with_list.close()


def test_a_chapter_that_is_missing(tmp_path):
    folder = chapters(tmp_path / "cam")
    joined = open_footage(folder, "cam")
    (folder / "GX020042.MP4").rename(tmp_path / "away.mp4")
    with pytest.raises(RecordingError, match=r"GX020042\.MP4 is not there any more"):
        joined.look_again()
    with pytest.raises(RecordingError, match=r"GX020042\.MP4 is not there any more"):
        joined.read(9)
    (tmp_path / "away.mp4").rename(folder / "GX020042.MP4")
    assert number(joined.read(9)) == 9
    joined.close()


def test_other_pictures_are_no_chapter(tmp_path):
    folder = chapters(tmp_path / "cam", lengths=(3, 3), names=("a.mp4", "b.mp4"))
    encode(folder / "b.mp4", n=3, rate=25)
    with pytest.raises(RecordingError, match=r"64x48 pixels at 30 per second, found 64x48 at 25 in b\.mp4"):
        open_footage(folder, "cam")


@pytest.mark.parametrize(
    "names",
    [
        ["GOPR0042.MP4", "GP010042.MP4", "GP020042.MP4"],
        ["GX010042.MP4", "GX020042.MP4", "GX110042.MP4"],
        ["C0009.MP4", "C0010.MP4"],
        ["DJI_20240311142530_0009_D.MP4", "DJI_20240311143012_0010_D.MP4"],
    ],
)
def test_order_of_chapters(tmp_path, names):
    for name in [*reversed(names), "notes.txt", ".hidden.mp4"]:
        (tmp_path / name).write_bytes(b"")
    assert [f.name for f in chapter_files(tmp_path)] == names


def test_images_are_no_chapters(tmp_path):
    folder = write_images(tmp_path / "cam", ["1.png", "2.png"])
    (folder / "preview.mp4").write_bytes(b"")
    assert open_footage(folder, "cam").n_frames == 2


@pytest.mark.parametrize(
    ("name", "following"),
    [
        ("GX010042.MP4", "GX020042.MP4"),
        ("GH010042.MP4", "GH020042.MP4"),
        ("GOPR0042.MP4", "GP010042.MP4"),
        ("GP010042.MP4", "GP020042.MP4"),
        ("C0009.MP4", "C0010.MP4"),
        ("MVI_0099.MP4", "MVI_0100.MP4"),
        ("DJI_0001.MP4", "DJI_0002.MP4"),
        ("cam1.mp4", None),
        ("GX010042.mov", None),
    ],
)
def test_next_chapter(tmp_path, name, following):
    for suffix in ("GX020042.MP4", "GH020042.MP4", "GP010042.MP4", "GP020042.MP4", "C0010.MP4", "MVI_0100.MP4"):
        (tmp_path / suffix).write_bytes(b"")
    (tmp_path / "DJI_0002.MP4").write_bytes(b"")
    chapter = next_chapter(tmp_path / name)
    assert (chapter and chapter.name) == following


def test_recording_of_chapters(tmp_path):
    from tracker.footage.camera_source import CameraSource
    from tracker.geometry.cameras import Camera

    camera = Camera("cam", (64, 48), np.array([[50.0, 0, 32], [0, 50, 24], [0, 0, 1]]), np.zeros(0), np.eye(4))
    with Recording([CameraSource(camera, chapters(tmp_path / "cam"), offset=2)], indices=tmp_path / "i") as recording:
        assert recording.n_frames == 23
        assert [number(recording.read(k)[0]) for k in (22, 0, 5, 4)] == [24, 2, 7, 6]
        assert recording.quick_frames(3) == [0, 9, 21]
