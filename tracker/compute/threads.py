"""Thread pools for kernels, which release the interpreter lock."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import TypeVar

S = TypeVar("S")


T = TypeVar("T")


U = TypeVar("U")


N_HELPERS = os.cpu_count() or 1
"""Threads that work side by side."""


@lru_cache(maxsize=1)
def helpers() -> ThreadPoolExecutor:
    """Threads that work besides the caller's; kernels let go of the interpreter's lock."""
    return ThreadPoolExecutor(N_HELPERS, thread_name_prefix="kernels")


def dealt_out(work: Callable[[S, U], T], rooms: Sequence[S], items: Sequence[U]) -> list[T]:
    """What some work makes of each of several things, in order, in as many threads as there are rooms to work in."""

    def share(room: S, own: Sequence[U]) -> list[T]:
        return [work(room, x) for x in own]

    n = len(rooms)
    shares = list(helpers().map(share, rooms, [items[i::n] for i in range(n)]))
    return [shares[i % n][i // n] for i in range(len(items))]


@lru_cache(maxsize=1)
def _besides() -> ThreadPoolExecutor:
    """Threads for what itself waits for `helpers`, which must not wait for one another."""
    return ThreadPoolExecutor(N_HELPERS, thread_name_prefix="beside")


def side_by_side(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """What some work makes of each of several things, the first here and the others in threads beside this one.

    The work may ask `helpers`, but not for this again.
    """
    others = [_besides().submit(work, x) for x in items[1:]]
    first = [work(x) for x in items[:1]]
    return first + [x.result() for x in others]
