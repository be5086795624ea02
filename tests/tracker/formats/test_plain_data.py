"""YAML of other programs is plain data: numbers as people write them, and nothing that takes long to read."""

import time

import pytest

from tracker.errors import CalibrationError
from tracker.formats.plain_data import parse_yaml
from tracker.formats.text_files import TextKind

KIND = TextKind("calibration", 500_000, CalibrationError)


@pytest.mark.parametrize("tail", ["", ".5"])
def test_numbers_to_the_base_sixty_are_text_and_take_no_time(tail):
    text = "1" + ":1" * 100_000 + tail
    times = []
    for written in (text, f'"{text}"'):
        start = time.thread_time()
        assert parse_yaml(f"a: {written}", "x", KIND) == {"a": text}
        times.append(time.thread_time() - start)
    assert times[0] < 10 * times[1]  # as a number, hundreds of times as long


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("12", 12), ("-7", -7), ("+0", 0), ("0x1f", 31), ("0b101", 5), ("017", 15), ("1_000", 1000), ("1.5", 1.5),
        ("1e-5", 1e-5), ("-2.5E+3", -2500.0), (".5", 0.5), (".inf", float("inf")),
    ],
)  # fmt: skip
def test_numbers(text, number):
    found = parse_yaml(f"a: {text}", "x", KIND)["a"]
    assert found == number
    assert type(found) is type(number)
