"""Thread pools for kernels, which release the interpreter lock."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import lru_cache
from typing import TypeVar

S = TypeVar("S")
T = TypeVar("T")
U = TypeVar("U")

N_HELPERS = int(os.environ.get("QUADRILLE_THREADS") or os.cpu_count() or 1)
"""Number of threads of each pool: QUADRILLE_THREADS, which workers of a batch share out, or one for each core."""


@lru_cache(maxsize=1)
def kernel_pool() -> ThreadPoolExecutor:
    """Return the pool for kernels, which release the interpreter lock."""
    return ThreadPoolExecutor(N_HELPERS, thread_name_prefix="kernels")


@lru_cache(maxsize=1)
def _task_pool() -> ThreadPoolExecutor:
    """Return a second pool, for tasks that wait on `kernel_pool`; sharing one pool could deadlock."""
    return ThreadPoolExecutor(N_HELPERS, thread_name_prefix="tasks")


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which linear algebra uses one thread: several make products of some hundred rows slower.

    The fit of a rig with 8 frames, 4 views and 160 unknowns took 14.3 s of processor time, and 2.2 s with one thread.
    Tracking 60 frames of one person in four views took 8.5 s, and 7.4 s with one thread.
    """
    from threadpoolctl import threadpool_limits  # imported lazily: it looks at all loaded libraries

    return threadpool_limits(1, "blas")


def map_chunked(work: Callable[[S, U], T], workspaces: Sequence[S], items: Sequence[U]) -> list[T]:
    """Apply work to each of several items in parallel, with a thread for each workspace; return the results in order.

    Args:
        work: called with a workspace and an item. No two calls use a workspace at the same time.
        workspaces: scratch of each thread.
        items: are dealt out in turn.
    """

    def chunk(workspace: S, own: Sequence[U]) -> list[T]:
        return [work(workspace, x) for x in own]

    n = len(workspaces)
    chunks = list(kernel_pool().map(chunk, workspaces, [items[i::n] for i in range(n)]))
    return [chunks[i % n][i // n] for i in range(len(items))]


def map_parallel(work: Callable[[S], T], items: Sequence[S]) -> list[T]:
    """Apply work to each of several items in parallel, the first in this thread; return the results in order.

    The work may use `kernel_pool`, but must not call this function.
    """
    others = [_task_pool().submit(work, x) for x in items[1:]]
    first = [work(x) for x in items[:1]]
    return first + [x.result() for x in others]
