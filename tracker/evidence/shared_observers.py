"""Observers of subsets of the same views, which share what does not depend on a prediction.

Several trackers that go through the same frames side by side, each without another camera, read and filter each view
once. They share the features of a region if they ask for the same one (`TrackingRun.regions`).
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import Future
from typing import Any, TypeVar

from tracker.evidence.foreground import Prepared
from tracker.evidence.observer import FRAMES_AHEAD, Observer
from tracker.evidence.view_evidence import EdgeSettings, RegionFeatures
from tracker.geometry.cameras import Region

T = TypeVar("T")


class _Shared:
    """Results by frame and key, each computed once. Thread-safe."""

    def __init__(self) -> None:
        self._frames: OrderedDict[int, dict[Hashable, Future[Any]]] = OrderedDict()
        self._lock = threading.Lock()

    def once(self, k: int, key: Hashable, compute: Callable[[], T]) -> T:
        """Return what the first call for frame k and a key computes; the others wait for it."""
        with self._lock:
            known = self._frames.setdefault(k, {})
            self._frames.move_to_end(k)
            while len(self._frames) > 1 + FRAMES_AHEAD:  # the present one, and those that are read ahead
                self._frames.popitem(last=False)
            is_first = key not in known
            future: Future[T] = known.setdefault(key, Future())
        if is_first:
            try:
                future.set_result(compute())
            except BaseException as error:
                future.set_exception(error)
        return future.result()


class _SharedObserver(Observer):
    """An observer of some views of another one."""

    def __init__(self, whole: Observer, chosen: Sequence[int], shared: _Shared) -> None:
        super().__init__(*whole._of(chosen))
        self._whole, self._chosen, self._shared = whole, tuple(chosen), shared

    def _prepare(self, k: int) -> list[Prepared | None]:
        prepared = self._shared.once(k, "prepared", lambda: self._whole._prepare(k))
        return [prepared[i] for i in self._chosen]

    def _find_features(
        self, k: int, i: int, prepared: Prepared | None, region: Region | None, with_static_edges: bool,
        settings: EdgeSettings,
    ) -> RegionFeatures:  # fmt: skip
        find, box = super()._find_features, self._box(i, region)
        key = self._chosen[i], box, with_static_edges, settings
        return self._shared.once(k, key, lambda: find(k, i, prepared, region, with_static_edges, settings))


def shared_observers(whole: Observer, groups: Sequence[Sequence[int]]) -> list[Observer]:
    """Return an observer of each of several groups of the views of another one, by their indices.

    They keep and share results of the last frames; use them side by side.
    """
    shared = _Shared()
    return [_SharedObserver(whole, chosen, shared) for chosen in groups]
