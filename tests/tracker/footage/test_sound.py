"""Offsets by sound and by a flash, from files and signals made here."""

import av
import cv2
import numpy as np
import pytest
from clips import SIZE, picture

from tracker.errors import RecordingError
from tracker.footage.flash import flash_of, tiles
from tracker.footage.sound import SoundSettings, read_sound, sound_delay

RATE = SoundSettings().rate


def recordings(delay_s, noise=0.3, seconds=6.0, seed=0):
    """Sound of clapping and speech-like noise in two recordings, the same sound later by a delay in the other."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    hz, spectrum = np.fft.rfftfreq(n, 1 / RATE), np.fft.rfft(rng.normal(size=n))
    spectrum[(hz > 5000) | (hz < 100)] = 0
    pair = [np.fft.irfft(spectrum * np.exp(-2j * np.pi * hz * d), n) for d in (0.0, delay_s)]
    return [(p + noise * rng.normal(size=n) * p.std()).astype(np.float32) for p in pair]


@pytest.mark.parametrize("delay_s", [0.01667, -0.4321, 0.00311, 1.25])
def test_delay_of_the_same_sound(delay_s):
    delay = sound_delay(*recordings(delay_s))
    assert delay.is_clear
    assert delay.delay_s == pytest.approx(delay_s, abs=2e-5)
    assert delay.sigma_s < 0.001


def test_other_sound_is_not_clear():
    one, _ = recordings(0.1, seed=1)
    other, _ = recordings(0.1, seed=2)
    assert not sound_delay(one, other).is_clear
    assert not sound_delay(one, np.zeros_like(one)).is_clear


def test_long_sound_is_cut(tmp_path):
    one, _ = recordings(0.0, seconds=4.0)
    path = filmed(tmp_path / "a.mp4", one)
    assert len(read_sound(path, "a")) == pytest.approx(4 * RATE, rel=0.1)
    assert len(read_sound(path, "a", SoundSettings(max_s=1.0))) == pytest.approx(RATE, rel=0.1)


def test_short_sound_has_no_delay():
    one, other = recordings(0.0, seconds=0.5)
    assert sound_delay(one, other) is None


def filmed(path, samples, rate=RATE, codec="aac"):
    """Write a video with sound."""
    with av.open(str(path), "w") as container:
        video, sound = container.add_stream("libx264", rate=30), container.add_stream(codec, rate=rate)
        video.width, video.height, video.pix_fmt = *SIZE, "yuv420p"
        sound.layout = "mono"
        for i in range(int(30 * len(samples) / rate)):
            frame = av.VideoFrame.from_ndarray(picture(i % 60), format="rgb24")
            frame.pts = i
            container.mux(video.encode(frame))
        container.mux(video.encode())
        for first in range(0, len(samples) - 1023, 1024):
            frame = av.AudioFrame.from_ndarray(samples[None, first : first + 1024], format="flt", layout="mono")
            frame.sample_rate, frame.pts = rate, first
            container.mux(sound.encode(frame))
        container.mux(sound.encode())
    return path


def test_sound_of_videos(tmp_path):
    one, other = recordings(0.0437)
    read = [read_sound(filmed(tmp_path / f"{i}.mp4", 0.1 * s / s.std()), str(i)) for i, s in enumerate((one, other))]
    delay = sound_delay(*read)
    assert delay.is_clear
    assert delay.delay_s == pytest.approx(0.0437, abs=1e-4)


@pytest.mark.parametrize("odd", [np.nan, np.inf])
def test_sound_that_is_not_finite_is_refused(tmp_path, odd):
    samples = np.zeros(RATE, np.float32)
    samples[RATE // 2] = odd
    path = filmed(tmp_path / "a.mkv", samples, codec="pcm_f32le")
    with pytest.raises(RecordingError, match="camera 'a': expected sound of finite samples, found others"):
        read_sound(path, "a")


def lit(share_by_frame, before=60.0, after=120.0, seed=0):
    rng = np.random.default_rng(seed)
    return [before + (after - before) * np.clip(share, 0, 1) + rng.normal(0, 0.3, (3, 3)) for share in share_by_frame]


@pytest.mark.parametrize("at", [5.0, 5.25, 7.7])
def test_light_that_goes_on(at):
    flash = flash_of(lit([k + 1 - at for k in range(20)]))
    assert flash.is_clear
    assert flash.frame == pytest.approx(at, abs=0.05)


def test_person_and_noise_are_no_flash():
    levels = lit([0.0] * 20)
    for k in range(8, 20):
        levels[k][1, 1] += 60  # a bright shirt in the middle
    flash = flash_of(levels)
    assert flash is None or not flash.is_clear


def test_tiles_are_means():
    image = cv2.resize(np.arange(9, dtype=np.uint8).reshape(3, 3), (60, 45), interpolation=cv2.INTER_NEAREST)
    np.testing.assert_allclose(tiles(np.repeat(image[..., None], 3, axis=2)), np.arange(9).reshape(3, 3))
