"""The footage of one camera: a video file or a folder of images, with random access to frame k.

Frame k is the k-th frame that decoding from the start would show. All video is decoded here, because two decoders
disagree on rotation, colour and frame numbers. Videos are turned by their display matrix and images by their EXIF
orientation, as OpenCV and therefore calibration tools read them. Mirrored matrices are applied as players apply them.
"""

import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from tracker.errors import RecordingError
from tracker.footage import frame_index, packet_scan
from tracker.footage.chapters import ChapteredVideo, chapter_files
from tracker.footage.frame_index import Index
from tracker.footage.image_folder import ImageFolder
from tracker.footage.packet_scan import PacketScan, TimeStamps
from tracker.footage.video_decoder import (
    MAX_PASSED_BYTES,
    FrameReader,
    VideoDecoder,
    display_turn,
    displayed_rgb,
    displayed_size,
    open_container,
)
from tracker.geometry.arrays import Image, IntArray

_ATTEMPTS = 2
"""Number of times that a frame is read: again if the file was replaced meanwhile."""


class FileVersion(NamedTuple):
    """A version of a file: it changes with the content."""

    device: int
    inode: int
    size: int
    """Bytes."""
    changed_ns: int
    """Time of the last change, ns."""


class VideoFile:
    """A video file whose frames are listed on opening or in the background. Safe to use from several threads.

    The file may be truncated, replaced or removed at any time: reading it is an error then, until it is back.
    """

    path: Path
    size: tuple[int, int]
    """Width and height as displayed, px."""
    is_mirrored: bool
    """Whether the display matrix exchanges left and right."""
    fps: float
    """Mean frame rate, 1/s; the header's rate while frames are being listed."""
    has_constant_rate: bool
    """Whether all intervals between frames are equal; true while frames are being listed."""
    stamps: TimeStamps | None
    """Start and regularity of the time stamps; None while frames are being listed."""
    version: int
    """Number of times that the file was opened again because it had changed."""

    def __init__(
        self,
        path: Path,
        camera: str,
        indices: Path | None = None,
        in_background: bool = False,
        passed_bytes: int = MAX_PASSED_BYTES,
    ) -> None:
        """Open a video and list its frames.

        Args:
            path: the file.
            camera: name of its camera, for messages.
            indices: folder in which indices of videos are cached; None for no cache.
            in_background: do not wait for a list that is not cached: `read` waits until the frame is in it.
            passed_bytes: bound on the frames kept for steps backward, bytes.

        Raises:
            RecordingError: the file is missing, unreadable, truncated, too large, or has no usable time stamps.
        """
        self.path, self._indices, self.version = path, indices, 0
        self._where = f"camera '{camera}': video {path}"
        self._lock = threading.Lock()  # guards the decoder
        self._converter = VideoReformatter()
        self._grown = threading.Condition()  # guards the four below
        self._listed = PacketScan(Index(np.empty(0, np.int64), {}, np.empty(0, np.int64)), 0.0)
        self._is_listed, self._closed = False, False
        self._failure: RecordingError | None = None
        self._reader: FrameReader | None = None
        self._passed_bytes = passed_bytes
        self._refused: tuple[FileVersion, str] | None = None  # the last version that could not be opened, and why
        if not path.is_file():
            raise RecordingError(f"{self._where} not found; check the path")
        self._opened_version = self._present_version()
        try:
            with closing(VideoDecoder(path, self._where)) as decoder:
                declared_rate = float(decoder.stream.average_rate or 0)
                index = frame_index.load(path, indices)
                if index is None and not in_background:
                    index = self._list()
                if index is not None:
                    self._finish(index, declared_rate, decoder.tick_s)
                first = next(decoder.frames, None) if index is None else self._first_frame(index, decoder)
            self._open()
        except av.FFmpegError as error:
            raise self._unreadable(error) from error
        if first is None:
            raise RecordingError(f"{self._where} has no frames; record or convert it again")
        self.size, self.is_mirrored = displayed_size(first), display_turn(first).is_mirror
        if not self._is_listed:
            self.fps, self.has_constant_rate, self.stamps = declared_rate or 1.0, True, None
            rates = (declared_rate, decoder.tick_s)
            threading.Thread(target=self._list_in_background, args=rates, name="list frames", daemon=True).start()

    @property
    def n_frames(self) -> int:
        """Number of frames; while frames are being listed, the number listed so far."""
        return len(self._listed.frames.pts)

    @property
    def key_frames(self) -> IntArray:
        """Frames listed so far that are decoded alone, ascending, (n,)."""
        listed = self._listed.frames
        return np.searchsorted(listed.pts, listed.key_pts)

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
            RecordingError: k is out of range, or the file cannot be read, is missing, or is not what it was.
        """
        self.look_again()  # a file that is back has its frames again
        self.wait_for(k)
        if not 0 <= k < self.n_frames:
            raise RecordingError(f"{self._where}: expected a frame from 0 to {self.n_frames - 1}, found {k}")
        with self._lock:
            for _ in range(_ATTEMPTS):
                self._follow_file()
                image = self._read_once(k)
                if self._present_version() == self._opened_version:
                    return image
            raise RecordingError(f"{self._where} is being written; wait until it is complete")

    def look_again(self) -> None:
        """Open the file again if it has changed.

        Raises:
            RecordingError: it is missing, cannot be read, or is not what it was.
        """
        with self._lock:
            self._follow_file()

    def close(self) -> None:
        """Release the file."""
        with self._grown:
            self._closed = True
            self._grown.notify_all()
        with self._lock:
            self._release()

    # --- the file and its versions ------------------------------------------------------------------------------

    def _open(self) -> None:
        """Open a reader of the present version."""
        self._release()
        self._reader = FrameReader(self.path, self._where, self._listed.frames, self._passed_bytes)

    def _release(self) -> None:
        """Close the reader; nothing can reach it afterwards."""
        reader, self._reader = self._reader, None
        if reader is not None:
            reader.close()

    def _present_version(self) -> FileVersion:
        """Return the present version of the file.

        Raises:
            RecordingError: it is missing.
        """
        try:
            stat = self.path.stat()
            return FileVersion(stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns)
        except FileNotFoundError:
            raise RecordingError(f"{self._where} is not there any more; put it back") from None
        except OSError as error:
            raise RecordingError(f"{self._where} cannot be reached: {error.strerror}; check the disk") from error

    def _follow_file(self) -> None:
        """Open the file again if it has changed or was released.

        Raises:
            RecordingError: it cannot be opened, or has other frames than before.
        """
        if self._closed:
            raise RecordingError(f"{self._where} has been closed")
        try:
            version = self._present_version()
        except RecordingError:
            self._release()
            raise
        if version == self._opened_version:
            if self._reader is None:
                try:
                    self._open()
                except av.FFmpegError as error:
                    raise self._unreadable(error) from error
            return
        if self._refused is not None and self._refused[0] == version:
            raise RecordingError(self._refused[1])
        self._release()
        try:
            self._take_version(version)
        except (av.FFmpegError, RecordingError) as error:
            self._release()
            failure = self._unreadable(error) if isinstance(error, av.FFmpegError) else error
            if not isinstance(error, OSError):  # as a network drive has that is not there for a moment
                self._refused = version, str(failure)
            raise failure from error

    def _take_version(self, found: FileVersion) -> None:
        """Open another version of the file, and check that it has the frames that were listed.

        Raises:
            RecordingError: it is unreadable or different.
            av.FFmpegError: it cannot be opened.
        """
        with closing(VideoDecoder(self.path, self._where)) as decoder:
            index = frame_index.load(self.path, self._indices) or self._list()
            before = self._listed.frames.pts
            both = min(len(before), len(index.pts))
            is_same = np.array_equal(index.pts[:both], before[:both])
            if not is_same or both < len(before) or (self._is_listed and len(index.pts) != len(before)):
                raise self._changed(
                    f"the {len(before)} frames of before",
                    f"{len(index.pts)}{'' if is_same else ' with other time stamps'}",
                )
            size = displayed_size(self._first_frame(index, decoder))
            if size != self.size:
                raise self._changed(f"{self.size[0]}x{self.size[1]} pixels as before", f"{size[0]}x{size[1]}")
            declared_rate = float(decoder.stream.average_rate or 0)
        self._finish(index, declared_rate, decoder.tick_s)
        self._open()
        self._opened_version, self._refused = found, None
        self.version += 1

    def _unreadable(self, error: av.FFmpegError) -> RecordingError:
        return RecordingError(f"{self._where} cannot be read: {error.strerror}; it may be truncated, or not a video")

    def _changed(self, expected: str, found: str) -> RecordingError:
        return RecordingError(
            f"{self._where} has changed: expected {expected}, found {found}; put the former file back, or open the "
            "session again"
        )

    # --- decoding -----------------------------------------------------------------------------------------------

    def _read_once(self, k: int) -> Image | None:
        """Decode frame k of the version that is open; None if it is damaged."""
        assert self._reader is not None
        try:
            frame = self._reader.read(self._listed.frames, k)
            image = None if frame is None else displayed_rgb(frame, self._converter)
        except av.FFmpegError as error:
            self._release()  # its position is unknown
            if self._present_version() != self._opened_version:
                return None  # the next attempt opens the present version
            raise RecordingError(f"{self._where} cannot be read any more: {error.strerror}; check the disk") from error
        if image is not None and image.shape[1::-1] != self.size:
            raise RecordingError(
                f"{self._where}: expected {self.size[0]}x{self.size[1]} pixels as in the first frame, found "
                f"{image.shape[1]}x{image.shape[0]} in frame {k}; convert it to one size"
            )
        return image

    # --- the list of frames -------------------------------------------------------------------------------------

    def _list(self, report: Callable[[PacketScan], None] | None = None) -> Index:
        """List the frames with a decoder of its own, and cache the list.

        Raises:
            RecordingError: the video is truncated, has no usable time stamps, or is being written.
            av.FFmpegError: it cannot be read.
        """
        version = self._present_version()
        with open_container(self.path, self._where) as container:
            index = packet_scan.list_frames(container, self._where, report)
        if self._present_version() != version:
            raise RecordingError(f"{self._where} is being written; wait until it is complete")
        frame_index.save(self.path, self._indices, index)
        return index

    def _list_in_background(self, declared_rate: float, tick_s: float) -> None:
        """List the frames while others read those listed so far."""
        try:
            self._finish(self._list(self._grow), declared_rate, tick_s)
        except av.FFmpegError as error:
            self._fail(self._unreadable(error))
        except RecordingError as error:
            self._fail(error)

    def _grow(self, listed: PacketScan) -> None:
        if not self.n_frames:
            with closing(VideoDecoder(self.path, self._where)) as decoder:
                self._first_frame(listed.frames, decoder)
        with self._grown:
            if self._closed or self._is_listed:  # another version is listed meanwhile
                raise RecordingError(f"{self._where} has been closed")
            self._listed = listed
            self._grown.notify_all()

    def _finish(self, index: Index, declared_rate: float, tick_s: float) -> None:
        with self._grown:
            self.fps, self.has_constant_rate = packet_scan.rate_of(index, declared_rate, tick_s)
            self.stamps = packet_scan.time_stamps_of(index, tick_s)
            self._listed, self._is_listed, self._failure = PacketScan(index, 1.0), True, None
            self._grown.notify_all()

    def _fail(self, error: RecordingError) -> None:
        with self._grown:
            if not self._is_listed:
                self._failure = error
            self._grown.notify_all()

    def wait_for(self, k: int) -> None:
        """Wait until frame k is listed, or the list is complete."""
        with self._grown:
            self._grown.wait_for(
                lambda: k < len(self._listed.frames.pts) or self._is_listed or self._failure or self._closed
            )
            if self._failure and k >= len(self._listed.frames.pts):
                raise self._failure
            if self._closed:
                raise RecordingError(f"{self._where} has been closed")

    def _first_frame(self, index: Index, decoder: VideoDecoder) -> VideoFrame:
        return packet_scan.check_order(index, decoder, self._where)


Footage = VideoFile | ImageFolder | ChapteredVideo


def open_footage(
    path: Path,
    camera: str,
    indices: Path | None = None,
    in_background: bool = False,
    passed_bytes: int = MAX_PASSED_BYTES,
) -> Footage:
    """Open a video file, a folder of images, or one of the chapters of a video.

    Args:
        path: the file or folder.
        camera: name of its camera, for messages.
        indices: this and the following as for `VideoFile`.
        in_background: of each file.
        passed_bytes: of all files together.

    Raises:
        RecordingError: it is missing, unreadable, truncated or empty.
    """
    if path.is_dir() and (files := chapter_files(path)):
        of_each = passed_bytes // len(files)
        return ChapteredVideo(path, camera, [VideoFile(f, camera, indices, in_background, of_each) for f in files])
    if path.is_dir():
        return ImageFolder(path, camera)
    return VideoFile(path, camera, indices, in_background, passed_bytes)
