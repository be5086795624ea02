"""The rows of the first start in `quadrille bench`: compilation of the kernels in an empty cache."""

import os
import subprocess
import tempfile
from collections.abc import Iterator

from app.bench.rows import Row, Yardstick, in_yardsticks
from tracker.system import own_module

_MUST = {"cost": in_yardsticks(60_000), "all": in_yardsticks(190_000)}
_AIMS = {"cost": in_yardsticks(40_000), "all": in_yardsticks(90_000)}
"""Largest allowed and desired processor time, in yardsticks."""


def first_start(yardstick: Yardstick) -> Iterator[Row]:
    """Compile all kernels in a process of its own; one row until the first cost of a pose, one until all are there."""
    (_, _, yardstick_us) = yardstick.beside(lambda: None, runs=40)
    with tempfile.TemporaryDirectory() as cache:
        words = [*own_module("app.bench.compile_kernels"), "--times"]
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    spent = {stage: (float(own), float(clock)) for stage, own, clock in map(str.split, done.stdout.splitlines())}
    for stage, text in (("cost", "until the first cost of a pose"), ("all", "all kernels")):
        own_s, clock_s = spent[stage]
        what = f"first start, kernels compiled: {text}"
        yield Row(f"first_start_{stage}", what, 1e6 * own_s, 1e6 * clock_s, yardstick_us, _MUST[stage], _AIMS[stage])
