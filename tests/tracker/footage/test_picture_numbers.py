"""The number of the picture in names of files that hold dates, clocks, hashes and numbers of objects as well."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.footage.picture_numbers import picture_numbers

CLOCK = [f"20240311_14253{k // 30}" for k in range(90)]


@pytest.mark.parametrize(
    "name",
    [
        lambda k: f"left_{k:04d}",
        lambda k: f"cam2-take3.{k}",
        lambda k: f"{CLOCK[k]}_{k:06d}",
        lambda k: f"{k:06d}_{CLOCK[k]}",
        lambda k: f"2024-03-11_14-25-3{k // 30}.{1000 * (k % 30) // 30:03d}_img{k}",
        lambda k: f"frame{k:06d}-1698000{17 + k // 30:03d}.{10**6 * (k % 30) // 30:06d}",
        lambda k: f"FRONT_{k:06d}_jpg.rf.{hash(str(k)) & (2**128 - 1):032x}",
        lambda k: f"{random.Random(k).randbytes(4).hex()}-FRONT_{k:06d}",
        lambda k: f"FRONT_{k:06d}_30fps",
        lambda k: f"{k:06d}_0",
        lambda k: f"mask_{k:05d}_obj1",
        lambda k: f"{k:04d}_{random.Random(k).randrange(10**8):08d}",
        lambda k: f"CAM1_{k}_CAM1_{k}",
    ],
)
def test_the_number_that_runs_is_the_picture(name):
    order = random.Random(1).sample(range(7, 71), 64)
    assert picture_numbers([name(k) for k in order]).numbers == tuple(order)


@given(st.lists(st.integers(0, 89), min_size=40, max_size=89, unique=True))
def test_pictures_may_be_missing(numbers):
    names = [f"{CLOCK[k]}_{k:06d}" for k in sorted(numbers)]
    assert picture_numbers(names).numbers in (tuple(sorted(numbers)), None)  # None of too few


@pytest.mark.parametrize("several", [lambda k, o: f"{k:06d}_{o}", lambda k, o: f"obj{o}/mask_{k:05d}"])
def test_objects_of_one_picture(several):
    pairs = [(k, o) for k in range(3) for o in (1, 2)]
    names = [several(k, o) for k, o in pairs]
    assert picture_numbers(names, may_repeat=True).numbers == tuple(k for k, _ in pairs)
    assert picture_numbers(names).numbers is None  # of footage each picture is one file


@pytest.mark.parametrize(
    ("names", "times"),
    [
        (["1698000017_033333", "1698000017_933333", "1698000018_033366"], [0, 0.9, 1.000033]),
        (["20231231-235959.900", "20240101-000000.100"], [0, 0.2]),
        (["2024-03-11T14-25-30.5", "2024-03-11T14-25-31.5", "2024-03-11T14-26-30.5"], [0, 1, 60]),
        (["14h25m30s", "14h25m31s", "14h27m30s", "14h29m30s"], [0, 1, 120, 240]),
        ([f"14-25-3{k * 33367 // 10**6}.{k * 33367 // 1000 % 1000:03d}" for k in range(91)], None),
        ([str(1698000374895 + 40 * k) for k in range(9)], [k / 25 for k in range(9)]),
        (["33367", "66731", "100100", "133401"], [0, 33364, 66733, 100034]),
    ],
)
def test_times_in_names(names, times):
    numbers = picture_numbers(names)
    assert numbers.numbers is None
    assert "and no number that rises by one" in numbers.reason
    times = [k * 0.033367 for k in range(91)] if times is None else times
    assert [t - numbers.times[0] for t in numbers.times] == pytest.approx(times, abs=1e-3)


def test_a_time_beside_the_number_is_kept():
    numbers = picture_numbers([f"{k:04d}_1698000{17 + k // 4:03d}.{250 * (k % 4):03d}" for k in range(12)])
    assert numbers.numbers == tuple(range(12))
    assert numbers.times == tuple(1698000017 + k / 4 for k in range(12))


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        ([f"{k:03d}_{k + 9:03d}" for k in range(5)], "it may be 0 to 4 or 9 to 13"),
        ([f"take{t}_{k:03d}" for t in (1, 2) for k in range(9)], "it may be 1 to 2 or 0 to 8"),
        ([f"14253{k // 30}_{k % 30:02d}" for k in range(90)], "it may be 142530 to 142532 or 0 to 29"),
        (["front", "left"], "no number alone changes from 'front' to 'left'"),
        (["a1", "b2"], "no number alone changes"),
        (["5_of_9"], "'5_of_9' alone does not show which number counts"),
    ],
)
def test_doubt_is_named_with_its_readings(names, reason):
    numbers = picture_numbers(names)
    assert (numbers.numbers, numbers.times) == (None, None)
    assert reason in numbers.reason


@pytest.mark.parametrize("names", [["mask_12"], ["a_" + 5000 * "9"], ["²_1", "²_2"], ["", "1"]])
def test_odd_names(names):
    picture_numbers(names, may_repeat=True)


def test_one_file():
    assert picture_numbers(["000012_keypoints"]).numbers == (12,)


@given(st.lists(st.text("0129_-. aFé²١", max_size=12), min_size=1, max_size=8, unique=True), st.booleans())
def test_any_names(names, may_repeat):
    numbers = picture_numbers(names, may_repeat)
    assert (numbers.numbers is None) == bool(numbers.reason)
    for values in (numbers.numbers, numbers.times):
        assert values is None or len(values) == len(names)
    if numbers.numbers is not None and not may_repeat:
        assert len(set(numbers.numbers)) == len(names)


@pytest.mark.parametrize("width", [3, 6, 9])
@pytest.mark.parametrize("begin", ["169800001", "20240311_14251"])
def test_fractions_without_zeros_ahead(width, begin):
    """33 ms are written as 33, as Python's f"{seconds}_{microseconds}" does."""
    names = [f"{begin}{7 + (27 + k) // 30}_{10**width * ((27 + k) % 30) // 30}" for k in range(40)]
    times = picture_numbers(names).times
    assert [t - times[0] for t in times] == pytest.approx([k / 30 for k in range(40)], abs=2e-3)


def test_decimals_without_zeros_at_the_end():
    names = ["17.05", "17.1", "17.15", "17.9", "18.251"]
    assert picture_numbers(names).times == (17.05, 17.1, 17.15, 17.9, 18.251)


def test_fractions_that_may_be_either():
    """Is 17_5 half a second or five thousandths?"""
    assert picture_numbers(["17_425", "17_85", "18_275", "18_7"]).times is None
