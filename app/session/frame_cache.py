"""Cache images and evidence of a few frames for the page; evidence is computed in the background."""

import logging
import threading
import time
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache

import cv2

from app.drawing import pictures
from app.remedies import page_text
from app.runtime.byte_bounded_cache import ByteBoundedCache
from tracker.errors import RecordingError
from tracker.evidence.images.working_view import WorkingView
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.footage.camera_source import CameraSource
from tracker.footage.proxy import Proxy
from tracker.geometry.arrays import Image

_LOG = logging.getLogger(__name__)
_IMAGE_BYTES = 16 * 2**20
"""Bound on undistorted images: about four frames of four 640x480 views. The recording caches decoded ones."""
_PICTURE_BYTES = 16 * 2**20
"""Bound on JPEG pictures: about 150 frames of four panes."""
_SIZES = 64
"""Number of picture sizes whose resampling maps are cached."""
_EVIDENCE_BYTES = 96 * 2**20
_REST_S = 0.2
"""Usual time a frame is shown before its evidence is computed: pictures come first, and scrubbing needs no evidence."""
_WAIT_S = 1.0
"""Maximum time that evidence waits for pictures in the making."""


class FrameCache:
    """Images, pictures and evidence of a recording. Safe to use from several threads."""

    def __init__(self, observer: Observer, proxies: Sequence[Proxy | None] = (), rest_s: float = _REST_S) -> None:
        """Wrap an observer; nothing is read yet.

        Args:
            observer: gives images and evidence.
            proxies: of each camera's footage, or None. Images to look at come from the proxies, evidence comes from the
                footage.
            rest_s: time a frame is shown before its evidence is computed.
        """
        self.observer, self._proxies, self._rest_s = observer, list(proxies), rest_s
        self._empty_caches()
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="evidence")
        self._wanted: dict[object, int] = {}  # by who asks
        self._asked: dict[object, float] = {}  # when each asked for a new frame
        self._n_pictures = 0  # number of pictures in the making
        self._idle = threading.Condition()
        self._failed: dict[Hashable, Callable[[], object]] = {}  # what could not be read, and how to try it again
        self._failed_lock = threading.Lock()
        self.on_unreadable: Callable[[], None] = lambda: None
        """Called when footage could not be read, from any thread; `problem` returns the reason."""

    def set_cameras(self, cameras: Sequence[CameraSource]) -> None:
        """Continue with other calibrations of the same cameras; what was made with the former ones is dropped.

        Raises:
            RecordingError: a background cannot be read.
        """
        self.observer = self.observer.with_sources(cameras)
        self._empty_caches()

    def _empty_caches(self) -> None:
        self._images = ByteBoundedCache(self._undistorted, _IMAGE_BYTES)
        self._pictures = ByteBoundedCache(self._picture, _PICTURE_BYTES)
        self._resamplers = lru_cache(_SIZES)(self._resampler)
        self._evidence = ByteBoundedCache(lambda key: self.observer.evidence(key[0]), _EVIDENCE_BYTES)

    def images(self, frame: int) -> tuple[Image | None, ...]:
        """Return the undistorted images of all views, shared by all callers; None for a damaged or unreadable one."""
        return tuple(self._image_or_none(frame, camera) for camera in range(len(self.observer.cameras)))

    def evidence(self, frame: int) -> tuple[ViewEvidence, ...]:
        """Return the evidence of a frame; computes it if needed.

        Raises:
            RecordingError: the frame is not indexed yet, or cannot be read.
        """
        if not self._is_indexed(frame):
            share = self.observer.recording.listed_share or 0.0
            raise RecordingError(
                f"frame {frame} is not there yet: the footage is being indexed ({share:.0%} so far); wait a moment"
            )
        try:
            return self._evidence.get(self._versions(frame))
        except RecordingError:
            self._remember("evidence", lambda: self._evidence.get(self._versions(frame)))
            raise

    def problem(self) -> str | None:
        """Try to read again what could not be read; return what is wrong, or None if all can be read."""
        with self._failed_lock:
            failed = dict(self._failed)
        errors = dict.fromkeys(self.observer.recording.problems())
        for what, read in failed.items():
            try:
                read()
            except RecordingError as error:
                errors[page_text(error)] = None
                continue
            with self._failed_lock:
                if self._failed.get(what) is read:
                    del self._failed[what]
        more = len(errors) - 1
        also = f" (and {more} other{'s' if more > 1 else ''} like it)" if more > 0 else ""
        return next(iter(errors)) + also if errors else None

    def _remember(self, what: Hashable, read: Callable[[], object]) -> None:
        """Remember the last thing of a kind that could not be read."""
        with self._failed_lock:
            self._failed[what] = read
        self.on_unreadable()

    @property
    def listed_share(self) -> float | None:
        """Share of the footage that is indexed, 0 to 1; None for all of it.

        Raises:
            RecordingError: indexing found a damaged file.
        """
        return self.observer.recording.listed_share

    def listed(self, frame: int) -> bool:
        """Return whether the pictures of a frame can be made without waiting for the index."""
        return all(
            self._proxy_of(frame, camera) is not None or self.observer.recording.listed(camera, frame)
            for camera in range(len(self.observer.cameras))
        )

    def _is_indexed(self, frame: int) -> bool:
        """Return whether the footage itself is indexed at a frame, as evidence requires."""
        recording = self.observer.recording
        return all(recording.listed(camera, frame) for camera in range(len(self.observer.cameras)))

    def cached_evidence(self, frame: int) -> tuple[ViewEvidence, ...] | None:
        """Return the evidence of a frame if it is cached."""
        return self._evidence.peek(self._versions(frame))

    def request(self, frame: int, done: Callable[[int], None], asker: object = None) -> None:
        """Compute the evidence of a frame in the background, unless the same one asks for another first.

        Work starts when the request is a moment old and no picture is in the making. Where frames pass, as in playback
        on a busy machine, the moment is twice as long as the last frame was shown: nobody waits for this evidence.

        Args:
            frame: whose evidence is computed.
            done: called with the frame afterwards.
            asker: who asks. Each person at work shows a frame of their own.
        """
        asked, rest_s = time.monotonic(), self._rest_s
        if self._wanted.get(asker) != frame:
            passing_s = 2 * (asked - self._asked.get(asker, -_WAIT_S))
            rest_s = max(rest_s, passing_s) if passing_s < _WAIT_S else rest_s
            self._wanted[asker], self._asked[asker] = frame, asked

        def work() -> None:
            while self._wanted.get(asker) == frame and time.monotonic() < asked + rest_s:
                time.sleep(rest_s / 8)
            with self._idle:
                self._idle.wait_for(lambda: not self._n_pictures, _WAIT_S)
            try:
                if self._wanted.get(asker) == frame and self._is_indexed(frame):
                    self.evidence(frame)
                    done(frame)
            except RecordingError as error:  # the pages show `problem`
                _LOG.debug("no evidence of frame %d: %s", frame, error)
            except Exception:
                _LOG.exception("no evidence of frame %d", frame)

        self._pool.submit(work)

    def forget(self, asker: object) -> None:
        """Cancel the requests of one who asks no more."""
        self._wanted.pop(asker, None)
        self._asked.pop(asker, None)

    def close(self) -> None:
        """Cancel the requests."""
        self._wanted = {}
        self._pool.shutdown(wait=True, cancel_futures=True)

    def image(self, frame: int, camera: int, reduction: float = 1) -> bytes:
        """Return the undistorted image of one view as JPEG, reduced by a factor along either side.

        An image that is damaged or cannot be read is a placeholder that says so.
        """
        with self._making_picture():
            try:
                return self._pictures.get(self._picture_key(frame, camera, reduction))
            except RecordingError:
                self._remember_view(frame, camera)
                return pictures.unreadable(self._resamplers(camera, reduction).camera.size)

    def cached_image(self, frame: int, camera: int, reduction: float) -> bytes | None:
        """Return the picture of `image` if it is cached."""
        return self._pictures.peek(self._picture_key(frame, camera, reduction))

    @property
    def is_listed(self) -> bool:
        """Whether all footage is indexed."""
        try:
            return self.listed_share is None
        except RecordingError:
            return False

    @property
    def is_making_pictures(self) -> bool:
        """Whether a picture of a page is in the making, which other work gives way to."""
        return self._n_pictures > 0

    @contextmanager
    def _making_picture(self) -> Generator[None, None, None]:
        with self._idle:
            self._n_pictures += 1
        try:
            yield
        finally:
            with self._idle:
                self._n_pictures -= 1
                self._idle.notify_all()

    def _picture(self, key: tuple[int, int, float, int]) -> bytes:
        """Make the picture of a frame, camera, reduction and version, resampled once."""
        frame, camera, reduction, _ = key
        image, view = self._read(frame, camera), self._resamplers(camera, reduction)
        return pictures.footage(None if image is None else view.image(image, view.whole), view.camera.size)

    def _picture_key(self, frame: int, camera: int, reduction: float) -> tuple[int, int, float, int]:
        return frame, camera, reduction, self.observer.recording.version(camera)

    def _resampler(self, camera: int, reduction: float) -> WorkingView:
        return WorkingView(self.observer.cameras[camera].camera, 1 / reduction, cv2.BORDER_CONSTANT)

    def _image_or_none(self, frame: int, camera: int) -> Image | None:
        try:
            return self._images.get((frame, camera, self.observer.recording.version(camera)))
        except RecordingError:
            self._remember_view(frame, camera)
            return None

    def _undistorted(self, key: tuple[int, int, int]) -> Image | None:
        """Return the undistorted image of a frame, camera and version."""
        frame, camera, _ = key
        image = self._read(frame, camera)
        return None if image is None else self.observer.cameras[camera].camera.undistort_image(image)

    def _versions(self, frame: int) -> tuple[int, ...]:
        """Return a frame and the version of each camera's footage, which its evidence depends on."""
        return frame, *(self.observer.recording.version(camera) for camera in range(len(self.observer.cameras)))

    def _remember_view(self, frame: int, camera: int) -> None:
        self._remember(camera, lambda: self.observer.recording.read_view(camera, frame))

    def _read(self, frame: int, camera: int) -> Image | None:
        """Read a frame of a camera as filmed, from its proxy if that contains the frame."""
        proxy = self._proxy_of(frame, camera)
        if proxy is not None:
            try:
                return proxy.read(frame + self.observer.cameras[camera].offset)
            except RecordingError as error:
                _LOG.warning("%s; the footage is shown without it", error)
                self._proxies[camera] = None
        return self.observer.recording.read_view(camera, frame)

    def _proxy_of(self, frame: int, camera: int) -> Proxy | None:
        """Return the proxy of a camera if it contains the frame and the footage is still what it was made from."""
        proxy = self._proxies[camera] if self._proxies else None
        if proxy is None or self.observer.recording.version(camera) > 0:
            return None
        return proxy if frame + self.observer.cameras[camera].offset < proxy.n_frames else None
