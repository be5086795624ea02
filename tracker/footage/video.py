"""The footage of one camera: a video file or a folder of images, with random access to frame k.

Frame k is the k-th frame that decoding from the start would show. All video is decoded here, because two decoders
disagree on rotation, colour and frame numbers. Videos are rotated by their display rotation and images by their EXIF
orientation, as OpenCV and therefore calibration tools read them.
"""

import re
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from itertools import chain
from pathlib import Path

import av
import cv2
import numpy as np
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from tracker.errors import RecordingError
from tracker.footage import frame_index, packet_scan
from tracker.footage.frame_index import Index
from tracker.footage.packet_scan import PacketScan
from tracker.geometry.arrays import Image

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")

# Number of frames whose time stamps are compared with the decoder's, enough for any order of B-frames to show.
_CHECKED_FRAMES = 16
# The rate is variable if intervals between frames differ by more than this share of the median interval.
_RATE_JITTER = 0.2
# As the number of the next frame that the decoder gives: unknown, so that the next read seeks.
_NOWHERE = 2**62


class VideoFile:
    """A video file whose frames are listed on opening or in the background. Safe to use from several threads."""

    path: Path
    size: tuple[int, int]
    """Width and height as displayed, px."""
    fps: float
    """Mean frame rate, 1/s; the header's rate while frames are being listed."""
    has_constant_rate: bool
    """Whether all intervals between frames are equal; true while frames are being listed."""

    def __init__(self, path: Path, camera: str, indices: Path | None = None, in_background: bool = False) -> None:
        """Open a video and list its frames.

        Args:
            path: the file.
            camera: name of its camera, for messages.
            indices: folder in which indices of videos are cached; None for no cache.
            in_background: do not wait for a list that is not cached: `read` waits until the frame is in it.

        Raises:
            RecordingError: the file is missing, unreadable, truncated, or has no usable time stamps.
        """
        self.path, self._indices = path, indices
        self._where = f"camera '{camera}': video {path}"
        self._lock = threading.Lock()
        self._converter = VideoReformatter()
        self._grown = threading.Condition()  # guards the four below
        self._listed = PacketScan(Index(np.empty(0, np.int64), {}, np.empty(0, np.int64)), 0.0)
        self._is_listed, self._closed = False, False
        self._failure: RecordingError | None = None
        self._index = self._listed.frames
        if not path.is_file():
            raise RecordingError(f"{self._where} not found; check the path")
        try:
            self._open()
            cached = frame_index.load(path, indices)
            if cached is not None:
                self._finish(cached)
            elif not in_background:
                self._list()
            self._index = self._listed.frames
            first = self._check_order(self._index) if self._is_listed else next(self._frames, None)
            self._container.close()
            self._open()
        except av.FFmpegError as error:
            raise self._unreadable(error) from error
        if first is None:
            raise RecordingError(f"{self._where} has no frames; record or convert it again")
        self.size = (first.width, first.height) if first.rotation % 180 == 0 else (first.height, first.width)
        if not self._is_listed:
            self.fps, self.has_constant_rate = float(self._stream.average_rate or 1.0), True
            threading.Thread(target=self._list_in_background, name="list frames", daemon=True).start()

    @property
    def n_frames(self) -> int:
        """Number of frames; while frames are being listed, the number listed so far."""
        return len(self._listed.frames.pts)

    @property
    def listed_share(self) -> float | None:
        """Share of the file that has been listed, 0 to 1; None when all is.

        Raises:
            RecordingError: listing the file has failed.
        """
        with self._grown:
            if self._failure:
                raise self._failure
            return None if self._is_listed else self._listed.share

    def read(self, k: int) -> Image | None:
        """Decode frame k, (H, W, 3) RGB; None if the frame is damaged.

        Raises:
            RecordingError: k is out of range, or the file cannot be read any more.
        """
        self._wait_for(k)
        if not 0 <= k < self.n_frames:
            raise RecordingError(f"{self._where}: expected a frame from 0 to {self.n_frames - 1}, found {k}")
        with self._lock:
            if self._closed:
                raise RecordingError(f"{self._where} has been closed")
            if self._index is not self._listed.frames:
                # The decoder's position refers to the shorter list.
                self._index, self._next = self._listed.frames, _NOWHERE
            try:
                frame = self._decode_frame(k)
            except av.FFmpegError as error:
                raise RecordingError(
                    f"{self._where} cannot be read any more: {error.strerror}; check the disk"
                ) from error
            return None if frame is None else self._to_rgb(frame)

    def close(self) -> None:
        """Release the file."""
        with self._grown:
            self._closed = True
            self._grown.notify_all()
        with self._lock:
            self._frames.close()
            self._container.close()

    def _open(self) -> None:
        """Move the decoder before the first frame."""
        self._container = av.open(str(self.path))
        if not self._container.streams.video:
            raise RecordingError(f"{self._where}: expected a video, found a file without a video stream")
        self._stream = self._container.streams.video[0]
        # Frame threads would delay the output by as many frames; cameras are decoded in parallel anyway.
        self._stream.thread_type = "SLICE"
        self._tick_s = float(self._stream.time_base or 0)
        self._frames = self._decode(self._container.demux(self._stream))
        self._next = 0

    def _to_rgb(self, frame: VideoFrame) -> Image:
        # One converter for all frames: preparing one takes longer than a conversion.
        image = self._converter.reformat(frame, format="rgb24").to_ndarray()
        # The display rotation is counter-clockwise, like that of rot90.
        return np.ascontiguousarray(np.rot90(image, frame.rotation // 90))

    def _decode_frame(self, k: int) -> VideoFrame | None:
        """Decode frame k; None if it is damaged."""
        if not self._reaches_soon(k):
            self._seek(self._best_key(k))
            frame = self._decode_until(k)
            if frame is not None:
                return frame
            # Some containers (MPEG program streams) lose the first time stamps after a seek: start earlier.
            self._seek(max(0, self._best_key(k) - 2))
        return self._decode_until(k)

    def _decode_until(self, k: int) -> VideoFrame | None:
        target = int(self._index.pts[k])
        for frame in self._frames:
            assert frame.pts is not None  # the index has no frame without one
            self._next = int(np.searchsorted(self._index.pts, frame.pts, side="right"))
            if frame.pts >= target:
                return frame if frame.pts == target and not frame.is_corrupt else None
        return None

    def _decode(self, packets: Iterable[Packet]) -> Generator[VideoFrame, None, None]:
        """Decode packets to frames in display order; damaged packets yield nothing."""
        for packet in packets:
            try:
                yield from packet.decode()
            except av.InvalidDataError:
                continue

    def _list(self, report: Callable[[PacketScan], None] | None = None) -> None:
        """List the frames with a decoder of its own."""
        with av.open(str(self.path)) as container:
            index = packet_scan.list_frames(container, self._where, report)
        frame_index.save(self.path, self._indices, index)
        self._finish(index)

    def _list_in_background(self) -> None:
        """List the frames while others read those listed so far."""
        try:
            self._list(self._grow)
        except av.FFmpegError as error:
            self._fail(self._unreadable(error))
        except RecordingError as error:
            self._fail(error)

    def _grow(self, listed: PacketScan) -> None:
        if not self.n_frames:
            with av.open(str(self.path)) as container:
                stream = container.streams.video[0]
                self._check_order(listed.frames, self._decode(container.demux(stream)))
        with self._grown:
            if self._closed:
                raise RecordingError(f"{self._where} has been closed")
            self._listed = listed
            self._grown.notify_all()

    def _finish(self, index: Index) -> None:
        self.fps, self.has_constant_rate = self._rate(index)
        with self._grown:
            self._listed, self._is_listed = PacketScan(index, 1.0), True
            self._grown.notify_all()

    def _fail(self, error: RecordingError) -> None:
        with self._grown:
            self._failure = error
            self._grown.notify_all()

    def _wait_for(self, k: int) -> None:
        """Wait until frame k is listed, or the list is complete."""
        with self._grown:
            self._grown.wait_for(
                lambda: k < len(self._listed.frames.pts) or self._is_listed or self._failure or self._closed
            )
            if self._failure and k >= len(self._listed.frames.pts):
                raise self._failure
            if self._closed:
                raise RecordingError(f"{self._where} has been closed")

    def _unreadable(self, error: av.FFmpegError) -> RecordingError:
        return RecordingError(f"{self._where} cannot be read: {error.strerror}; it may be truncated, or not a video")

    def _check_order(self, index: Index, frames: Iterator[VideoFrame] | None = None) -> VideoFrame:
        """Check that the decoder shows frames in the order of their time stamps; return the first."""
        first, frames = None, frames or self._frames
        for expected in index.pts[:_CHECKED_FRAMES]:
            frame = next(frames, None)
            if frame is None or frame.pts != expected:
                raise RecordingError(
                    f"{self._where} has time stamps that do not follow the order of its frames, as AVI files with "
                    "B-frames have; convert it to MP4"
                )
            first = first or frame
        assert first is not None
        return first

    def _rate(self, index: Index) -> tuple[float, bool]:
        intervals = np.diff(index.pts)
        declared = float(self._stream.average_rate or 0)
        if not len(intervals):
            return declared or 1.0, True
        mean = float(1 / (intervals.mean() * self._tick_s))
        usual = np.median(intervals)
        # Coarse ticks (a millisecond in Matroska) shift single frames by up to one tick.
        constant = bool(np.all(np.abs(intervals - usual) <= max(_RATE_JITTER * usual, 1)))
        # The header's rate is exact; the mean over a short clip is rounded to ticks.
        return (declared if constant and abs(declared / mean - 1) < 0.005 else mean), constant

    def _best_key(self, k: int) -> int:
        """Return the index of the last key frame from which frame k decodes completely.

        That is the last one shown no later. A frame stored after a key frame but shown before it may depend on frames
        stored before the key frame.
        """
        return int(np.searchsorted(self._index.key_pts, self._index.pts[k], side="right")) - 1

    def _reaches_soon(self, k: int) -> bool:
        """Return whether decoding on from the current position is the shortest way to frame k."""
        if k < self._next:
            return False
        return self._next == k or self._index.key_pts[self._best_key(k)] <= self._index.pts[self._next]

    def _seek(self, best: int) -> None:
        """Move the decoder to a key frame, given by its index, or before it."""
        # Some containers land after the requested time; then request an earlier key frame.
        latest = self._index.position[int(self._index.key_pts[best])]
        for pts in self._index.key_pts[max(0, best - 2) : best + 1][::-1].tolist():
            try:
                self._container.seek(pts, stream=self._stream)
                packets = self._container.demux(self._stream)
                first = next(packets)
            except (av.FFmpegError, StopIteration):
                continue
            if first.pts is not None and self._index.position[first.pts] <= latest:
                self._frames = self._decode(chain([first], packets))
                return
        self._container.close()
        self._open()


class ImageFolder:
    """A folder of images of one kind, in the natural order of their names (2 before 10)."""

    path: Path
    size: tuple[int, int]
    """Width and height, px."""
    n_frames: int
    fps: None = None
    """Images have no frame rate."""
    has_constant_rate: bool = True
    listed_share: None = None

    def __init__(self, path: Path, camera: str) -> None:
        """List the images and read the first.

        Args:
            path: the folder.
            camera: name of its camera, for messages.

        Raises:
            RecordingError: no images, images of several kinds, or the first is unreadable.
        """
        self.path = path
        self._where = f"camera '{camera}': image folder {path}"
        images = [f for f in path.iterdir() if f.suffix.lower() in IMAGE_SUFFIXES and not f.name.startswith(".")]
        kinds = sorted({f.suffix.lower() for f in images})
        if len(kinds) != 1:
            raise RecordingError(
                f"{self._where}: expected images of one kind ({', '.join(IMAGE_SUFFIXES)}), "
                f"found {' and '.join(kinds) or 'none'}; leave only the frames of this camera in it"
            )
        self._files = sorted(images, key=_natural)
        self.n_frames = len(self._files)
        height, width = read_image(self._files[0], self._where).shape[:2]
        self.size = (width, height)

    def read(self, k: int) -> Image | None:
        """Decode frame k, (H, W, 3) RGB; None if the image is damaged.

        Raises:
            RecordingError: k is out of range, or the image is missing or of another size.
        """
        if not 0 <= k < self.n_frames:
            raise RecordingError(f"{self._where}: expected a frame from 0 to {self.n_frames - 1}, found {k}")
        image = _read_image_or_none(self._files[k], self._where)
        if image is not None and image.shape[1::-1] != self.size:
            raise RecordingError(
                f"{self._where}: expected {self.size[0]}x{self.size[1]} pixels as in the first image, found "
                f"{image.shape[1]}x{image.shape[0]} in {self._files[k].name}; give all images one size"
            )
        return image

    def close(self) -> None:
        """Do nothing: no file stays open."""


Footage = VideoFile | ImageFolder


def open_footage(path: Path, camera: str, indices: Path | None = None, in_background: bool = False) -> Footage:
    """Open a video file or a folder of images; `indices` and `in_background` as for `VideoFile`.

    Raises:
        RecordingError: it is missing, unreadable, truncated or empty.
    """
    return ImageFolder(path, camera) if path.is_dir() else VideoFile(path, camera, indices, in_background)


def read_image(path: Path, where: str) -> Image:
    """Read an image as 8-bit RGB, (H, W, 3); `where` begins the message.

    Raises:
        RecordingError: the file is missing or not an image.
    """
    image = _read_image_or_none(path, where)
    if image is None:
        raise RecordingError(f"{where}: {path} is damaged or not an image; export it again")
    return image


def _read_image_or_none(path: Path, where: str) -> Image | None:
    try:
        # Not cv2.imread, which cannot open every path on every system and prints.
        data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise RecordingError(f"{where}: cannot read {path}: {error.strerror}; check the path") from error
    image = cv2.imdecode(data, cv2.IMREAD_COLOR_RGB) if data.size else None
    return None if image is None else np.asarray(image, dtype=np.uint8)


def _natural(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key that compares runs of digits as numbers."""
    return [(0, int(t)) if t.isdigit() else (1, t) for t in re.split(r"(\d+)", path.name) if t]
