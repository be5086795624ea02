"""Frames and their evidence for the page: computed once in the background, kept for a few frames."""

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Generic, TypeVar

import cv2
import numpy as np

from app.state import Base
from tracker.evidence import Observer, ViewEvidence
from tracker.silhouettes import Image

_KEPT_FRAMES = 6
_JPEG_QUALITY = 85

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

    def __init__(self, observer: Observer) -> None:
        """Wrap an observer; nothing is read yet."""
        self.observer = observer
        self._images = _Recent(observer.images)
        self._evidence = _Recent(observer.evidence)
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="evidence")
        self._wanted: int | None = None

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

    def jpeg(self, frame: int, camera: int, base: Base) -> bytes:
        """Picture of one view for the page, in undistorted pixels (evidence at the scale of matching)."""
        if base == "image":
            image = self._images.get(frame)[camera]
            if image is None:
                return _encode(_blank(self.observer.cameras[camera].camera.size, "frame damaged"))
            return _encode(image)
        view = self._evidence.get(frame)[camera]
        if base == "edges":
            edges = np.where(view.distance == 0, 235, 18).astype(np.uint8)
            return _encode(np.repeat(edges[..., None], 3, axis=-1))
        return _encode(_colour_distance(view))


def _colour_distance(view: ViewEvidence) -> Image:
    """Distance image, bright at the edges, dark where the limit is reached."""
    near = 1.0 - view.distance / max(1e-6, float(view.distance.max()))
    coloured = cv2.applyColorMap((255 * near).astype(np.uint8), cv2.COLORMAP_INFERNO)
    return np.asarray(cv2.cvtColor(coloured, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _blank(size: tuple[int, int], text: str) -> Image:
    image = np.full((size[1], size[0], 3), 24, np.uint8)
    cv2.putText(image, text, (20, size[1] // 2), cv2.FONT_HERSHEY_SIMPLEX, size[0] / 640, (200, 200, 200), 2)
    return image


def _encode(image: Image) -> bytes:
    done, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    assert done
    return bytes(data)
