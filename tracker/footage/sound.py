"""Offsets between cameras from the sound of their videos.

The sound of two cameras is the same up to a delay and the echoes of the room. Their correlation peaks at the delay.
Each frequency of a band has equal weight in it (generalized cross-correlation with phase transform: C. Knapp and
G. Carter 1976). A parabola through the peak gives the delay below a sample. Sound takes 3 ms for a metre.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import RecordingError
from tracker.geometry.arrays import TINY, Array, FloatArray


@dataclass(frozen=True)
class SoundSettings:
    """Settings of the correlation."""

    rate: int = 16_000
    """Samples per second to which sound is reduced."""
    band_hz: tuple[float, float] = (200.0, 6_000.0)
    """Frequencies that count: hum is below, little but noise above."""
    clear_ratio: float = 2.0
    """Smallest ratio of the peak to the highest one elsewhere. Of unrelated noise it stays below 1.3."""
    width_s: float = 0.01
    """Distance from the peak from which another counts as elsewhere, s, and the largest difference between the delays
    of both halves. Early echoes lie nearer."""
    min_s: float = 1.0
    """Shortest sound that is compared, s."""
    max_s: float = 300.0
    """Longest sound that is read, s. Its correlation takes 0.6 gigabytes; that of an hour would take 8."""


class Delay(NamedTuple):
    """How much later the same sound is heard in one recording than in another."""

    delay_s: float
    sigma_s: float
    """Half the difference between the delays of both halves of the recordings, s."""
    ratio: float
    """Height of the peak over that of the highest elsewhere."""
    is_clear: bool
    """Whether the peak stands out, in both halves at the same delay."""


def read_sound(path: Path, name: str, settings: SoundSettings | None = None) -> FloatArray | None:
    """Read the sound of a video from its first picture on, mono, (n,); None without sound.

    Args:
        path: the video.
        name: of the camera, for messages.
        settings: give the rate.

    Raises:
        RecordingError: the video cannot be read.
    """
    import av  # imported lazily: PyAV takes 0.1 s to load

    settings = settings or SoundSettings()
    rate = settings.rate
    if path.is_dir():
        return None
    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                return None
            sound, video = container.streams.audio[0], container.streams.video[0]
            resampler, pieces, first_s = av.AudioResampler("flt", "mono", rate), list[FloatArray](), None
            for frame in container.decode(sound):
                if first_s is None:
                    first_s = frame.time or 0.0
                if (frame.time or 0.0) > first_s + settings.max_s:
                    break
                pieces += [np.asarray(f.to_ndarray()[0], np.float32) for f in resampler.resample(frame)]
            pieces += [np.asarray(f.to_ndarray()[0], np.float32) for f in resampler.resample(None)]
            begin_s = float((video.start_time or 0) * video.time_base) if video.time_base is not None else 0.0
    except (av.error.FFmpegError, OSError, ValueError) as error:
        raise RecordingError(
            f"camera '{name}': the sound of {path} cannot be read ({error}); check the file, or give offsets"
        ) from error
    if not pieces:
        return None
    samples = np.concatenate(pieces)
    if not np.isfinite(samples).all():
        raise RecordingError(
            f"camera '{name}': expected sound of finite samples, found others in {path}; export the sound again, or "
            "give offsets"
        )
    late = round(((first_s or 0.0) - begin_s) * rate)
    return np.concatenate([np.zeros(late, np.float32), samples]) if late > 0 else samples[-late:]


def sound_delay(one: FloatArray, other: FloatArray, settings: SoundSettings | None = None) -> Delay | None:
    """Return by how much the same sound comes later in the other recording; None if one is too short.

    Args:
        one: samples, (n,).
        other: samples, (m,).
        settings: of the correlation.
    """
    settings = settings or SoundSettings()
    if min(len(one), len(other)) < settings.min_s * settings.rate:
        return None
    delay, ratio = _peak(one, other, settings)
    first, last = max(0, round(-delay)), min(len(one), len(other) - round(delay))  # of the first, where both have sound
    middle, shift = (first + last) // 2, round(delay)
    halves = []
    for a, b in ((first, middle), (middle, last)):
        if b - a < settings.min_s * settings.rate / 2:
            return Delay(delay / settings.rate, float("inf"), ratio, False)
        halves.append(_peak(one[a:b], other[a + shift : b + shift], settings)[0])
    apart_s = abs(halves[0] - halves[1]) / settings.rate
    is_clear = ratio >= settings.clear_ratio and apart_s <= settings.width_s
    return Delay(delay / settings.rate, max(apart_s / 2, 1 / settings.rate), ratio, is_clear)


def _peak(one: FloatArray, other: FloatArray, settings: SoundSettings) -> tuple[float, float]:
    """Return the delay of the other recording, samples, and how much its peak stands out."""
    n = 1 << int(np.ceil(np.log2(len(one) + len(other))))
    spectrum = np.conj(np.fft.rfft(one, n)) * np.fft.rfft(other, n)
    hz = np.fft.rfftfreq(n, 1 / settings.rate)
    size = np.abs(spectrum)
    is_used = (hz >= settings.band_hz[0]) & (hz <= settings.band_hz[1]) & (size > 0)
    delays: Array = np.fft.irfft(np.where(is_used, spectrum / np.maximum(size, TINY), 0.0), n)
    best = int(np.argmax(delays))
    before, at, after = delays[best - 1], delays[best], delays[(best + 1) % n]
    bend = before - 2 * at + after
    exact = best + (0.5 * (before - after) / bend if bend < 0 else 0.0)
    around = (np.arange(n) - best + n // 2) % n - n // 2
    elsewhere = delays[np.abs(around) > settings.width_s * settings.rate].max()
    return float(exact if exact <= len(other) else exact - n), float(at / max(elsewhere, TINY))
