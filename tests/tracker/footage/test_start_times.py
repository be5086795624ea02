"""Time codes, GPS times and creation times of videos."""

import struct
from datetime import UTC, datetime
from fractions import Fraction

import pytest
from clips import encode, gpmf, write_images
from hypothesis import given
from hypothesis import strategies as st

from tracker.footage.start_times import read_start_times, time_code_frames

NTSC, DOUBLE = 30000 / 1001, 60000 / 1001


def counted(text, whole):
    """Number of a picture by a time code, counted one by one as SMPTE leaves numbers out."""
    hours, minutes, seconds, frame = (int(word) for word in text.replace(";", ":").split(":"))
    n = 0
    for minute in range(60 * hours + minutes + 1):
        skipped = whole // 15 if ";" in text and minute % 10 else 0
        n += 60 * whole - skipped if minute < 60 * hours + minutes else seconds * whole + frame - skipped
    return n


@pytest.mark.parametrize(
    ("text", "rate", "frames"),
    [
        ("00:00:59;29", NTSC, 1799),
        ("00:01:00;02", NTSC, 1800),  # follows the one before: ;00 and ;01 are left out
        ("00:09:59;29", NTSC, 17981),
        ("00:10:00;00", NTSC, 17982),
        ("01:00:00;00", NTSC, 107892),
        ("00:00:59;59", DOUBLE, 3599),
        ("00:01:00;04", DOUBLE, 3600),
        ("01:00:00.00", DOUBLE, 215784),
        ("01:00:00:00", NTSC, 108000),
        ("10:00:00:24", 25.0, 900024),
        ("00:00:01:23", 24000 / 1001, 47),
    ],
)
def test_number_of_a_time_code(text, rate, frames):
    assert time_code_frames(text, rate) == frames


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("00:01:00;00", NTSC),  # left out
        ("00:01:00;03", DOUBLE),
        ("00:00:00:30", NTSC),
        ("00:00:00;05", 25.0),  # no rate of television
        ("24:00:00:00", 25.0),
        ("00:61:00:00", 25.0),
        ("1:00:00:00", 25.0),
        ("00:00:00:٠١", 25.0),
        ("now", 25.0),
    ],
)
def test_no_time_code(text, rate):
    assert time_code_frames(text, rate) is None


@given(st.integers(0, 3), st.integers(0, 59), st.integers(0, 59), st.integers(4, 29), st.sampled_from("::;"))
def test_time_codes_count_each_picture(hours, minutes, seconds, frame, sign):
    text = f"{hours:02}:{minutes:02}:{seconds:02}{sign}{frame:02}"
    for rate, whole in ((NTSC, 30), (DOUBLE, 60)):
        assert time_code_frames(text, rate) == counted(text, whole)


@pytest.mark.parametrize("name", ["a.mp4", "a.mov", "a.mkv", "a.mxf", "a.avi"])
def test_time_code_of_containers(tmp_path, name):
    path = encode(tmp_path / name, n=3, rate=Fraction(30000, 1001), bframes=0, tags={"timecode": "10:00:00;05"})
    (start,) = read_start_times(path, "video")
    assert (start.source, start.text) == ("time code", "10:00:00;05")
    assert start.seconds == pytest.approx((1078920 + 5) / NTSC)
    assert start.step_s == pytest.approx(1 / NTSC)


def test_creation_time(tmp_path):
    whole = encode(tmp_path / "a.mp4", n=3, tags={"creation_time": "2026-01-02T03:04:05Z"})
    exact = encode(tmp_path / "a.mkv", n=3, tags={"creation_time": "2026-01-02T03:04:05.25Z"})
    unset = encode(tmp_path / "b.mkv", n=3, tags={"creation_time": "1970-01-01T00:00:09Z"})
    time_s = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC).timestamp()
    found = [read_start_times(path, "video") for path in (whole, exact, unset)]
    assert [[(s.seconds, s.step_s) for s in own] for own in found] == [[(time_s, 1)], [(time_s + 0.25, 1e-3)], []]


def telemetry(*items):
    """Telemetry of a second, as a camera nests it."""
    stream = b"".join(items)
    stream = gpmf(b"STRM", b"\0", 1, stream)
    return gpmf(b"DEVC", b"\0", 1, gpmf(b"DVNM", b"c", 1, b"Camera") + stream)


def gps_of_hero5(second, fix=3):
    return telemetry(
        gpmf(b"GPSF", b"L", 4, struct.pack(">L", fix)), gpmf(b"GPSU", b"U", 16, b"2601020304%06.3f" % second)
    )


def gps_of_hero11(second, fix=3):
    midnight = 1000 * (3 * 3600 + 4 * 60) + round(1000 * second)
    sample = struct.pack(">7i2H", 0, 0, 0, 0, 0, 9498, midnight, 150, fix)
    return telemetry(gpmf(b"TYPE", b"c", 1, b"lllllllSS"), gpmf(b"GPS9", b"?", 32, sample + sample))


@pytest.mark.parametrize("gps", [gps_of_hero5, gps_of_hero11])
def test_gps_time(tmp_path, gps):
    """The first second has no satellites yet; the others scatter by 4 ms."""
    path = encode(tmp_path / "a.mp4", n=3, telemetry=[gps(55, fix=0), gps(6.25), gps(7.254), gps(8.251)])
    (start,) = read_start_times(path, "video")
    assert (start.source, start.text[:23]) == ("GPS time", "2026-01-02 03:04:05.251")
    assert start.seconds == pytest.approx(datetime(2026, 1, 2, 3, 4, 5, 251_000, UTC).timestamp(), abs=1e-5)
    assert start.step_s == pytest.approx(0.004, abs=1e-5)


@given(st.binary(max_size=60), st.integers(0, 150))
def test_damaged_telemetry(data, at):
    from tracker.footage.start_times import _gps_times

    whole = gps_of_hero5(7)
    for piece in (data, whole[:at] + data, whole[:at], 3000 * b"DEVC\0\1\1\0"):
        assert len([*_gps_times(piece)]) <= 1


def test_no_clock(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"no video")
    paths = (tmp_path / "a.mp4", tmp_path / "missing.mp4", write_images(tmp_path / "f", ["1.png"]))
    assert [read_start_times(path, "video") for path in paths] == [(), (), ()]
    assert read_start_times(encode(tmp_path / "b.mp4", n=3), "video") == ()
