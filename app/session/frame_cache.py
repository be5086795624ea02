"""Frames and their evidence for the page: computed once in the background, kept for a few frames."""

import logging
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache

import cv2

from app.drawing import pictures
from app.runtime.byte_bounded_cache import ByteBoundedCache
from tracker.errors import RecordingError
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.footage.proxy import Proxy
from tracker.geometry.arrays import Image
from tracker.images.working_view import WorkingView

_LOG = logging.getLogger(__name__)
_IMAGE_BYTES = 16 * 2**20
"""What undistorted images may take: of four 640x480 views some four frames; decoded ones are kept by the recording."""
_PICTURE_BYTES = 16 * 2**20
"""What pictures of them may take: of four panes some hundred and fifty frames."""
_SIZES = 64
"""Sizes of pictures of which it is kept where their pixels lie in the footage."""
_EVIDENCE_BYTES = 96 * 2**20
_REST_S = 0.2
"""A frame has evidence after it has been shown for so long: pictures go out first, and who scrubs by wants no more."""
_WAIT_S = 1.0
"""Evidence waits no longer than this for pictures that are being made."""


class FrameCache:
    """What the page needs of a recording. Safe to use from several threads."""

    def __init__(self, observer: Observer, proxies: Sequence[Proxy | None] = ()) -> None:
        """Wrap an observer; nothing is read yet.

        Args:
            observer: gives images and evidence.
            proxies: of each camera's footage, where there is one; what is looked at comes from them, all else from the
                footage.
        """
        self.observer, self._proxies = observer, proxies
        self._images = ByteBoundedCache(self._look, _IMAGE_BYTES)
        self._pictures = ByteBoundedCache(self._picture, _PICTURE_BYTES)
        self._ways = lru_cache(_SIZES)(self._way)
        self._evidence = ByteBoundedCache(observer.evidence, _EVIDENCE_BYTES)
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="evidence")
        self._wanted: int | None = None
        self._looking = 0  # how many pictures are being made
        self._idle = threading.Condition()

    def images(self, frame: int) -> tuple[Image | None, ...]:
        """Undistorted images of all views, as whoever else shows the frame has them too; None for a damaged one."""
        return tuple(self._images.get((frame, camera)) for camera in range(len(self.observer.cameras)))

    def evidence(self, frame: int) -> tuple[ViewEvidence, ...]:
        """Evidence of a frame; waits for it.

        Raises:
            RecordingError: the frame is not listed yet, or cannot be read.
        """
        if not self._matched(frame):
            share = self.observer.recording.listed_share or 0.0
            raise RecordingError(
                f"frame {frame} is not there yet: the footage is being indexed ({share:.0%} so far); wait a moment"
            )
        return self._evidence.get(frame)

    @property
    def listed_share(self) -> float | None:
        """How far the footage has been listed, 0 to 1; None when all is.

        Raises:
            RecordingError: what was wrong with a file came out on the way.
        """
        return self.observer.recording.listed_share

    def listed(self, frame: int) -> bool:
        """Whether the pictures of a frame can be made without waiting for the lists of frames."""
        return all(
            self._proxy_of(frame, camera) is not None or self.observer.recording.listed(camera, frame)
            for camera in range(len(self.observer.cameras))
        )

    def _matched(self, frame: int) -> bool:
        """Whether the footage itself can be read without waiting, as evidence needs it."""
        recording = self.observer.recording
        return all(recording.listed(camera, frame) for camera in range(len(self.observer.cameras)))

    def cached_evidence(self, frame: int) -> tuple[ViewEvidence, ...] | None:
        """Evidence of a frame if it has been computed."""
        return self._evidence.peek(frame)

    def request(self, frame: int, done: Callable[[int], None]) -> None:
        """Compute the evidence of a frame in the background, unless another is requested before its turn comes.

        Its turn comes when the frame has rested for a moment and nobody waits for a picture.
        """
        self._wanted, asked = frame, time.monotonic()

        def work() -> None:
            while self._wanted == frame and time.monotonic() < asked + _REST_S:
                time.sleep(_REST_S / 8)
            with self._idle:
                self._idle.wait_for(lambda: not self._looking, _WAIT_S)
            try:
                if self._wanted == frame and self._matched(frame):
                    self._evidence.get(frame)
                    done(frame)
            except RecordingError as error:  # the pictures of the frame say it to whoever looks
                _LOG.warning("no evidence of frame %d: %s", frame, error)
            except Exception:
                _LOG.exception("no evidence of frame %d", frame)

        self._pool.submit(work)

    def close(self) -> None:
        """Give up what is still requested."""
        self._wanted = None
        self._pool.shutdown(wait=True, cancel_futures=True)

    def image(self, frame: int, camera: int, reduction: float = 1) -> bytes:
        """The undistorted image of one view as JPEG; `reduction` pixels of it, along either side, become one."""
        with self._somebody_looks():
            return self._pictures.get((frame, camera, reduction))

    @contextmanager
    def _somebody_looks(self) -> Iterator[None]:
        with self._idle:
            self._looking += 1
        try:
            yield
        finally:
            with self._idle:
                self._looking -= 1
                self._idle.notify_all()

    def _picture(self, key: tuple[int, int, float]) -> bytes:
        """The picture of a frame, camera and reduction: resampled once, at its size."""
        frame, camera, reduction = key
        image, way = self._read(frame, camera), self._ways(camera, reduction)
        return pictures.footage(None if image is None else way.image(image, way.whole), way.camera.size)

    def _way(self, camera: int, reduction: float) -> WorkingView:
        return WorkingView(self.observer.cameras[camera].camera, 1 / reduction, cv2.BORDER_CONSTANT)

    def _look(self, key: tuple[int, int]) -> Image | None:
        """Undistorted image of a frame and camera."""
        image = self._read(*key)
        return None if image is None else self.observer.cameras[key[1]].camera.undistort_image(image)

    def _read(self, frame: int, camera: int) -> Image | None:
        """A frame of a camera as filmed, from its proxy where there is one that goes so far."""
        proxy = self._proxy_of(frame, camera)
        if proxy is None:
            return self.observer.recording.read_view(camera, frame)
        return proxy.read(frame + self.observer.cameras[camera].offset)

    def _proxy_of(self, frame: int, camera: int) -> Proxy | None:
        """The proxy of a camera, where there is one that goes so far."""
        proxy = self._proxies[camera] if self._proxies else None
        at = frame + self.observer.cameras[camera].offset
        return None if proxy is None or at >= proxy.n_frames else proxy
