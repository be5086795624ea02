"""Results kept for a while: each is computed once, whoever asks, and all together stay below a number of bytes."""

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
    """One result, or the place for it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.results: list[T] = []
        self.n_bytes = 0


class ByteBoundedCache(Generic[K, T]):
    """The results of a function, those asked for last. Safe to use from several threads."""

    def __init__(self, compute: Callable[[K], T], most_bytes: int) -> None:
        """Keep nothing yet.

        Args:
            compute: the function; called without a lock that anybody else waits for.
            most_bytes: what all results may take; the one asked for last is kept however large it is.
        """
        self._compute, self._most_bytes = compute, most_bytes
        self._lock = threading.Lock()
        self._cells: OrderedDict[K, _Cell[T]] = OrderedDict()

    def get(self, key: K) -> T:
        """The result for a key; waits for it."""
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
        """The result for a key if it is there."""
        with self._lock:
            cell = self._cells.get(key)
        return cell.results[0] if cell is not None and cell.results else None

    @property
    def n_bytes(self) -> int:
        """What the results take."""
        with self._lock:
            return sum(cell.n_bytes for cell in self._cells.values())

    def _forget(self, key: K, cell: _Cell[T]) -> None:
        with self._lock:
            if self._cells.get(key) is cell:
                del self._cells[key]

    def _shrink(self) -> None:
        """Let the oldest go until the rest has room."""
        with self._lock:
            taken = sum(cell.n_bytes for cell in self._cells.values())
            for key, cell in list(self._cells.items())[:-1]:
                if taken <= self._most_bytes:
                    return
                taken -= cell.n_bytes
                if cell.n_bytes:  # else somebody computes it now
                    del self._cells[key]


def bytes_of(value: object) -> int:
    """What the arrays and byte strings within a value take; each counts as often as it is named.

    What a dataclass computes when it is asked for the first time counts from the beginning, at the size of the largest
    array beside it, since by then nobody weighs it again.
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
