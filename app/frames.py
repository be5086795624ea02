"""Frames and their evidence for the page: computed once in the background, kept for a few frames."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Generic, TypeVar

from app import pictures
from tracker.evidence import Observer, ViewEvidence
from tracker.proxy import Proxy
from tracker.silhouettes import Image

_KEPT_FRAMES = 6

T = TypeVar("T")


class _Recent(Generic[T]):
    """The results of a function for the last few frames; each is computed once, whoever asks."""

    def __init__(self, compute: Callable[[int], T]) -> None:
        self._compute, self._lock = compute, threading.Lock()
        self._cells: OrderedDict[int, tuple[threading.Lock, list[T]]] = OrderedDict()

    def get(self, frame: int) -> T:
        with self._lock:
            lock, result = self._cells.setdefault(frame, (threading.Lock(), []))
            self._cells.move_to_end(frame)
            while len(self._cells) > _KEPT_FRAMES:
                self._cells.popitem(last=False)
        with lock:
            if not result:
                result.append(self._compute(frame))
            return result[0]

    def peek(self, frame: int) -> T | None:
        with self._lock:
            cell = self._cells.get(frame)
        return cell[1][0] if cell is not None and cell[1] else None


class Frames:
    """What the page needs of a recording. Safe to use from several threads."""

    def __init__(self, observer: Observer, proxies: Sequence[Proxy | None] = ()) -> None:
        """Wrap an observer; nothing is read yet.

        Args:
            observer: gives images and evidence.
            proxies: of each camera's footage, where there is one; what is looked at comes from them, all else from the
                footage.
        """
        self.observer, self._proxies = observer, proxies
        self._images = _Recent(self._look)
        self._evidence = _Recent(observer.evidence)
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="evidence")
        self._wanted: int | None = None

    def images(self, frame: int) -> tuple[Image | None, ...]:
        """Undistorted images of all views, as whoever else shows the frame has them too; None for a damaged one."""
        return self._images.get(frame)

    def evidence(self, frame: int) -> tuple[ViewEvidence, ...]:
        """Evidence of a frame; waits for it."""
        return self._evidence.get(frame)

    def evidence_at_hand(self, frame: int) -> tuple[ViewEvidence, ...] | None:
        """Evidence of a frame if it has been computed."""
        return self._evidence.peek(frame)

    def request(self, frame: int, done: Callable[[int], None]) -> None:
        """Compute the evidence of a frame in the background, unless another is requested before its turn comes."""
        self._wanted = frame

        def work() -> None:
            if self._wanted == frame:
                self._evidence.get(frame)
                done(frame)

        self._pool.submit(work)

    def close(self) -> None:
        """Give up what is still requested."""
        self._wanted = None
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _look(self, frame: int) -> tuple[Image | None, ...]:
        """Undistorted images of a frame, from the proxies where all cameras have one that goes so far."""
        sources, proxies = self.observer.cameras, [p for p in self._proxies if p is not None]
        if len(proxies) < len(sources) or any(
            frame + s.offset >= p.n_frames for s, p in zip(sources, proxies, strict=True)
        ):
            return self.observer.images(frame)
        images = (p.read(frame + s.offset) for s, p in zip(sources, proxies, strict=True))
        return tuple(None if i is None else s.camera.undistort_image(i) for s, i in zip(sources, images, strict=True))

    def image(self, frame: int, camera: int, reduction: int = 1) -> bytes:
        """The undistorted image of one view as JPEG; `reduction` pixels of it, along either side, become one."""
        return pictures.footage(self._images.get(frame)[camera], self.observer.cameras[camera].camera.size, reduction)
