"""Random access to frame k of every camera of a session, and to the side files of its cameras."""

import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from copy import copy
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from tracker.errors import RecordingError
from tracker.footage import video_decoder
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import IMAGE_SUFFIXES, read_image, read_unchanged
from tracker.footage.video import open_footage
from tracker.geometry.arrays import Image

DEFAULT_CACHE_BYTES = 2 * video_decoder.MAX_PASSED_BYTES
"""Memory of decoded frames of all cameras, bytes: 72 frames of four cameras of 640x480, in RGB twice as large as those
that a decoder passed."""
_Key = tuple[int, int, int]
"""Camera, version of its footage, frame of the footage."""


class _DecodedFrames:
    """The decoded frames that were used last, bounded in bytes. Thread-safe."""

    def __init__(self, max_bytes: int) -> None:
        self._images: OrderedDict[_Key, Image] = OrderedDict()
        self._max_bytes, self._bytes, self._lock = max_bytes, 0, threading.Lock()

    def __contains__(self, key: _Key) -> bool:
        with self._lock:
            return key in self._images

    def get(self, key: _Key) -> Image | None:
        with self._lock:
            if key in self._images:
                self._images.move_to_end(key)
            return self._images.get(key)

    def keep(self, key: _Key, image: Image) -> None:
        with self._lock:
            if key in self._images:  # another thread was faster
                return
            self._images[key] = image
            self._bytes += image.nbytes
            while self._bytes > self._max_bytes:
                self._bytes -= self._images.popitem(last=False)[1].nbytes


class Recording:
    """The footage of all cameras, with a cache of frames bounded in bytes. Safe to use from several threads."""

    fps: float | None
    """Frame rate of the videos, 1/s; None if all cameras are folders of images."""

    def __init__(
        self,
        cameras: Sequence[CameraSource],
        cache_bytes: int = DEFAULT_CACHE_BYTES,
        indices: Path | None = None,
        in_background: bool = False,
    ) -> None:
        """Open the footage of all cameras, which lists the frames of every video.

        Args:
            cameras: footage and offset of each camera.
            cache_bytes: size of the cache of decoded frames, bytes; the frames in use come on top, and those kept for
                steps backward (`video_decoder.MAX_PASSED_BYTES`).
            indices: folder in which the lists of frames are cached; None for no cache.
            in_background: do not wait for lists that are not cached; see `listed_share`.

        Raises:
            RecordingError: footage is missing, unreadable, truncated or empty, its size is not the camera's, or it ends
                before its offset.
        """
        self._cameras = tuple(cameras)
        n_cameras = max(1, len(self._cameras))
        self._pool = ThreadPoolExecutor(n_cameras, thread_name_prefix="decode")
        more = indices, in_background, video_decoder.MAX_PASSED_BYTES // n_cameras
        self._footage = list(self._pool.map(lambda c: open_footage(c.footage, c.camera.name, *more), self._cameras))
        for source, footage in zip(self._cameras, self._footage, strict=True):
            check_size(source.camera.name, footage.path, footage.size, source.camera.size)
        if not in_background:
            self._check_offsets()
        self.fps = next((f.fps for f in self._footage if f.fps is not None), None)
        self._decoded = _DecodedFrames(cache_bytes)
        self._end: int | None = None  # number of frames, once all are listed

    def with_cameras(self, cameras: Sequence[CameraSource]) -> "Recording":
        """Return the same open footage, read with other offsets of the same cameras; either closes it for both."""
        other = copy(self)
        other._cameras, other._end = tuple(cameras), None
        return other

    @property
    def n_frames(self) -> int:
        """Number of frames that all cameras have; while frames are being listed, the number listed so far."""
        return min(f.n_frames - c.offset for c, f in zip(self._cameras, self._footage, strict=True))

    @property
    def listed_share(self) -> float | None:
        """Progress of listing the footage, 0 to 1, of the slowest camera; None when all is listed.

        Frames that are not listed yet can be read, but `read` waits for them. Frame numbers do not change.

        Raises:
            RecordingError: listing a file has failed.
        """
        shares = [f.listed_share for f in self._footage]
        return min((s for s in shares if s is not None), default=None)

    def listed(self, camera: int, k: int) -> bool:
        """Return whether frame k of a camera, by its index, can be read without waiting for the list of frames."""
        footage = self._footage[camera]
        return k + self._cameras[camera].offset < footage.n_frames or footage.listed_share is None

    def version(self, camera: int) -> int:
        """Return how often the footage of a camera, by its index, was found replaced; its frames may differ since."""
        return self._footage[camera].version

    def problems(self) -> list[str]:
        """Look at the files of all cameras again; return what is wrong with each that cannot be read, in order."""
        found = []
        for footage in self._footage:
            try:
                footage.look_again()
            except RecordingError as error:
                found.append(str(error))
        return found

    def read(self, k: int, cameras: Sequence[int] | None = None) -> tuple[Image | None, ...]:
        """Read frame k of each camera as filmed, (H, W, 3) RGB, not writable; None if it is damaged.

        Args:
            k: frame number.
            cameras: indices of the cameras to read; all by default.

        Raises:
            RecordingError: k is out of range, or a file cannot be read any more.
        """
        self._check(k)
        wanted = range(len(self._cameras)) if cameras is None else cameras
        return tuple(self._pool.map(lambda i: self._read_one(i, k), wanted))

    def read_each(self, frames: Sequence[int], cameras: Sequence[int] | None = None) -> tuple[Image | None, ...]:
        """Read a frame of each camera of its own; otherwise as `read`."""
        for k in frames:
            self._check(k)
        return tuple(self._pool.map(self._read_one, range(len(frames)) if cameras is None else cameras, frames))

    def read_view(self, camera: int, k: int) -> Image | None:
        """Read frame k of one camera, by its index; otherwise as `read`."""
        self._check(k)
        return self._read_one(camera, k)

    def quick_frames(self, n: int) -> list[int]:
        """Return at most n frames spread over the recording, ascending, that are soon read.

        They are the last key frames of the first camera before evenly spread frames, or these where key frames are few:
        a key frame is decoded alone, another one with all between.
        """
        source, footage = self._cameras[0], self._footage[0]
        evenly = np.unique(np.linspace(0, self.n_frames - 1, n).astype(int))
        keys = np.append(0, footage.key_frames - source.offset)
        nearest = np.unique(np.maximum(keys[np.searchsorted(keys[1:], evenly, side="right")], 0))
        return (nearest if len(nearest) == len(evenly) else evenly).tolist()

    def cached(self, k: int) -> bool:
        """Return whether frame k of every camera is in the cache."""
        keys = ((i, f.version, k + self._cameras[i].offset) for i, f in enumerate(self._footage))
        return all(key in self._decoded for key in keys)

    def close(self) -> None:
        """Release all files."""
        for footage in self._footage:
            footage.close()  # first: a reader may wait for the list of frames
        self._pool.shutdown()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.close()

    def _check(self, k: int) -> None:
        if self._end is None and self.listed_share is None:
            self._end = self.n_frames
        if k < 0 or (self._end is not None and k >= self._end):
            self._check_offsets()
            raise RecordingError(f"expected a frame from 0 to {self.n_frames - 1}, found {k}")

    def _check_offsets(self) -> None:
        """Check that each camera has a frame after its offset.

        Raises:
            RecordingError: one has none.
        """
        for source, footage in zip(self._cameras, self._footage, strict=True):
            if footage.n_frames <= source.offset:
                raise RecordingError(
                    f"camera '{source.camera.name}': expected an offset below its {footage.n_frames} frames, found "
                    f"{source.offset}; correct it in session.toml, or check the footage {footage.path}"
                )

    def _read_one(self, camera: int, k: int) -> Image | None:
        footage, at = self._footage[camera], k + self._cameras[camera].offset
        image = self._decoded.get((camera, footage.version, at))
        if image is None:
            image = footage.read(at)
            if image is not None:
                image.setflags(write=False)  # all readers share it
                self._decoded.keep((camera, footage.version, at), image)
        return image


def check_size(camera: str, path: Path, found: tuple[int, int], calibrated: tuple[int, int]) -> None:
    """Check that an image has the size that its camera was calibrated for; sizes are width, height, px.

    Raises:
        RecordingError: the sizes differ.
    """
    if found != calibrated:
        turned = "; the picture may be rotated" if found == calibrated[::-1] else ""
        raise RecordingError(
            f"camera '{camera}': expected {calibrated[0]}x{calibrated[1]} pixels as in the calibration, found "
            f"{found[0]}x{found[1]} in {path}{turned}; calibrate at the size of the footage or convert the footage"
        )


def read_background(source: CameraSource) -> Image | None:
    """Read the empty scene as filmed, (H, W, 3) RGB: an image, or the mean of a video; None if there is none.

    Raises:
        RecordingError: the file is missing, unreadable or of another size than the camera.
    """
    total, count = np.zeros(0), 0
    for image in background_frames(source):
        total = total + image if count else image.astype(np.float64)
        count += 1
    return np.round(total / count).astype(np.uint8) if count else None


def background_frames(source: CameraSource) -> Iterator[Image]:
    """Read the images of the empty scene as filmed, (H, W, 3) RGB: one, or those of a video; none if there is none.

    Raises:
        RecordingError: as `read_background`.
    """
    if source.background is None:
        return
    name, path, size, count = source.camera.name, source.background, source.camera.size, 0
    if path.suffix.lower() in IMAGE_SUFFIXES:
        image = read_image(path, f"camera '{name}': background")
        check_size(name, path, image.shape[1::-1], size)
        yield image
        return
    with closing(open_footage(path, name)) as footage:
        check_size(name, path, footage.size, size)
        for k in range(footage.n_frames):
            frame = footage.read(k)
            if frame is not None:
                count += 1
                yield frame
    if not count:
        raise RecordingError(f"camera '{name}': no frame of the background {path} can be decoded; record it again")


def read_mask(source: CameraSource, k: int) -> NDArray[np.uint8] | None:
    """Read the mask of frame k as filmed, (H, W); None if there is none.

    Pixels are 0 for the background, k for person k, `image_file.ANYONE` or `image_file.UNKNOWN`.

    Raises:
        RecordingError: the file is not a gray 8-bit image, or of another size than the camera.
    """
    if source.masks is None:
        return None
    path, where = source.masks / f"{k + source.offset:06d}.png", f"camera '{source.camera.name}'"
    if not path.exists():
        if not source.masks.is_dir():  # otherwise tracking would go on without any mask
            raise RecordingError(f"{where}: the folder of masks {source.masks} is not there; put it back")
        return None
    mask = read_unchanged(path, f"{where}: mask")
    if mask is None or mask.ndim != 2 or mask.dtype != np.uint8:
        shape = "no image" if mask is None else f"{mask.dtype} with {mask.shape[2] if mask.ndim > 2 else 1} channels"
        raise RecordingError(
            f"{where}: expected a gray 8-bit image as mask, found {shape} in {path}; export masks as single-channel PNG"
        )
    check_size(source.camera.name, path, mask.shape[1::-1], source.camera.size)
    return np.asarray(mask, dtype=np.uint8)
