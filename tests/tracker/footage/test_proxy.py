"""Proxies: the same frames under the same numbers, stopped and gone on with, and told from those of other footage."""

import itertools
from contextlib import closing

import numpy as np
import pytest
from clips import N, encode, number

from tracker.errors import RecordingError
from tracker.footage.proxy import Proxy
from tracker.footage.video import VideoFile


@pytest.fixture
def clip(tmp_path):
    return encode(tmp_path / "cam.mp4", gop=250, bframes=3)


@pytest.fixture
def proxy(tmp_path):
    return Proxy(tmp_path / "proxies", "cam")


def make(proxy, clip, frames=None):
    """Make a proxy, or only as many steps of it; returns the counts that it told."""
    with closing(VideoFile(clip, "cam")) as video:
        steps = proxy.make(clip, video)
        told = list(itertools.islice(steps, frames))
        steps.close()
    return told


def test_frames_keep_their_numbers(proxy, clip):
    assert not proxy.exists()
    assert make(proxy, clip)[-1] == N
    assert proxy.fits(clip)
    assert [number(proxy.read(k)) for k in (0, 59, 17, 18, 3)] == [0, 59, 17, 18, 3]
    with closing(VideoFile(clip, "cam")) as video:
        for k in (0, 30, 59):
            error = np.abs(proxy.read(k).astype(int) - video.read(k))
            assert error.mean() < 12  # a picture of it, to look at


def test_stopped_it_is_consistent_and_goes_on(proxy, clip, tmp_path):
    make(proxy, clip, 21)
    assert proxy.n_frames == 20
    assert [number(Proxy(tmp_path / "proxies", "cam").read(k)) for k in (0, 19)] == [0, 19]
    with pytest.raises(RecordingError, match="20 frames, not frame 20"):
        proxy.read(20)
    assert make(proxy, clip)[:2] == [20, 21]
    assert [number(proxy.read(k)) for k in (19, 20, 59)] == [19, 20, 59]


def test_half_a_row_of_a_dead_program_is_cut_off(proxy, clip, tmp_path):
    make(proxy, clip, 21)
    pictures, index = tmp_path / "proxies" / "cam.mjpeg", tmp_path / "proxies" / "cam.index"
    with pictures.open("ab") as file:
        file.write(b"half a picture")
    with index.open("ab") as file:
        file.write(b"\x01\x02\x03")
    assert make(proxy, clip)[0] == 20
    assert [number(proxy.read(k)) for k in range(N)] == list(range(N))
    with pictures.open("r+b") as file:
        file.truncate(pictures.stat().st_size - 10)
    again = Proxy(tmp_path / "proxies", "cam")
    assert make(again, clip)[0] == N - 1
    assert number(again.read(N - 1)) == N - 1


def test_other_footage_is_recognised_and_done_again(proxy, clip):
    make(proxy, clip)
    encode(clip, n=40)
    assert proxy.exists()
    assert not proxy.fits(clip)
    told = make(proxy, clip)
    assert (told[0], told[-1]) == (0, 40)
    assert proxy.fits(clip)


def test_it_cannot_be_written(proxy, clip, tmp_path):
    (tmp_path / "proxies").write_text("in the way")
    with pytest.raises(RecordingError, match="cannot write the proxy"):
        make(proxy, clip)


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage", [b"[" * 100_000, b"{", b"[1]", b'{"version": "1"}', b"\xff"], ids=lambda d: str(d[:6])
)
def test_a_damaged_note_on_its_source_is_that_of_no_footage(proxy, clip, tmp_path, damage):
    make(proxy, clip)
    (tmp_path / "proxies" / "cam.json").write_bytes(damage)
    assert not proxy.fits(clip)
    assert make(proxy, clip)[-1] == N
    assert proxy.fits(clip)
