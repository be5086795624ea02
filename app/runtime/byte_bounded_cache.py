"""Cache results by key within a number of bytes; each result is computed once, also with several threads."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import fields, is_dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class _Cell(Generic[T]):
    """One result, or the place for one that is being computed."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.results: list[T] = []
        self.n_bytes = 0


class ByteBoundedCache(Generic[K, T]):
    """The most recently used results of a function. Safe to use from several threads.

    Unlike `cachetools.LRUCache` it keeps a result that is larger than the bound: the evidence of many large views.
    """

    def __init__(self, compute: Callable[[K], T], max_bytes: int) -> None:
        """Begin empty.

        Args:
            compute: the function; other keys can be read while it runs.
            max_bytes: bound on the size of all results; the last one requested is kept even if it is larger.
        """
        self._compute, self._max_bytes = compute, max_bytes
        self._lock = threading.Lock()
        self._cells: OrderedDict[K, _Cell[T]] = OrderedDict()

    def get(self, key: K) -> T:
        """Return the result for a key; computes it or waits for it."""
        with self._lock:
            cell = self._cells.setdefault(key, _Cell())
            self._cells.move_to_end(key)
        with cell.lock:
            if not cell.results:
                try:
                    cell.results.append(self._compute(key))
                except BaseException:
                    self._forget(key, cell)
                    raise
                cell.n_bytes = bytes_of(cell.results[0])
                self._shrink()
            return cell.results[0]

    def peek(self, key: K) -> T | None:
        """Return the result for a key if it is cached."""
        with self._lock:
            cell = self._cells.get(key)
            if cell is not None:
                self._cells.move_to_end(key)
        return cell.results[0] if cell is not None and cell.results else None

    @property
    def n_bytes(self) -> int:
        """Size of all results, bytes."""
        with self._lock:
            return sum(cell.n_bytes for cell in self._cells.values())

    def _forget(self, key: K, cell: _Cell[T]) -> None:
        with self._lock:
            if self._cells.get(key) is cell:
                del self._cells[key]

    def _shrink(self) -> None:
        """Discard the least recently used results until the rest fits."""
        with self._lock:
            taken = sum(cell.n_bytes for cell in self._cells.values())
            for key, cell in list(self._cells.items())[:-1]:
                if taken <= self._max_bytes:
                    return
                taken -= cell.n_bytes
                if cell.n_bytes:  # else it is being computed
                    del self._cells[key]


def bytes_of(value: object) -> int:
    """Return the size of the arrays and byte strings within a value; one that occurs twice counts twice.

    Cached properties of a dataclass count at the size of its largest field, because a value is measured only once,
    before they are computed.
    """
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, (bytes, bytearray)):
        return len(value)
    if isinstance(value, dict):
        return sum(map(bytes_of, value.values()))
    if isinstance(value, (tuple, list)):
        return sum(map(bytes_of, value))
    if is_dataclass(value) and not isinstance(value, type):
        parts = [bytes_of(getattr(value, f.name)) for f in fields(value)]
        later = sum(isinstance(of, cached_property) for of in vars(type(value)).values())
        return sum(parts) + later * max(parts, default=0)
    return 0
