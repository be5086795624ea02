"""Results kept for a while: computed once, bounded in bytes."""

import threading
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest

from app.runtime.byte_bounded_cache import ByteBoundedCache, bytes_of


def test_each_is_computed_once_whoever_asks():
    begun, go = [], threading.Event()

    def compute(key):
        begun.append(key)
        go.wait(5)
        return bytes(10)

    recent = ByteBoundedCache(compute, 100)
    threads = [threading.Thread(target=recent.get, args=(3,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    assert recent.peek(3) is None
    go.set()
    for thread in threads:
        thread.join()
    assert begun == [3]
    assert recent.peek(3) == bytes(10)


def test_the_oldest_go_where_bytes_run_out_and_the_newest_stays_however_large():
    recent = ByteBoundedCache(lambda key: np.zeros(key, np.uint8), 1000)
    for key in (400, 401, 402):
        recent.get(key)
    assert [recent.peek(key) is not None for key in (400, 401, 402)] == [False, True, True]
    assert recent.n_bytes == 803
    recent.get(401)  # asked for again: no longer the oldest
    recent.get(300)
    assert recent.peek(402) is None
    recent.get(5000)
    assert recent.n_bytes == 5000


def test_failed_work_is_tried_again():
    tries = []

    def compute(key):
        tries.append(key)
        if len(tries) == 1:
            raise ValueError("not yet")
        return b"there"

    recent = ByteBoundedCache(compute, 100)
    with pytest.raises(ValueError, match="not yet"):
        recent.get(1)
    assert recent.get(1) == b"there"


def test_bytes_of_nested_values():
    @dataclass
    class View:
        image: np.ndarray
        rest: tuple

        @cached_property
        def smooth(self):
            return self.image * 2

    view = View(np.zeros((4, 5), np.float32), (b"abc", None, 7, [np.zeros(2, np.uint8)]))
    assert bytes_of(view) == 80 + 5 + 80  # what is computed later is counted from the beginning
