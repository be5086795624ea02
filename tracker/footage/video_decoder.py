"""Decode an opened video: from one place on, or frame k by random access; turn frames as they are displayed."""

from collections import OrderedDict
from collections.abc import Generator, Iterable
from itertools import chain
from pathlib import Path
from typing import NamedTuple, cast

import av
import numpy as np
from av.container import InputContainer
from av.packet import Packet
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter

from tracker.errors import RecordingError
from tracker.footage.frame_index import Index
from tracker.footage.image_file import MAX_PIXELS, check_pixels
from tracker.geometry.arrays import Image

_OPTIONS = {"max_pixels": str(MAX_PIXELS)}
"""A stream can have other sizes than its header: the decoder refuses them as well."""
_FORMATS = (
    "mov,mp4,m4a,3gp,3g2,mj2", "matroska,webm", "avi", "mpegts", "mpeg", "mpegvideo", "asf", "flv", "live_flv", "ogg",
    "mxf", "gxf", "wtv", "dv", "nut", "ivf", "obu", "av1", "h261", "h263", "h264", "hevc", "vvc", "m4v", "vc1", "dnxhd",
    "mjpeg", "mpjpeg", "mjpeg_2000", "yuv4mpegpipe", "gif", "cine", "r3d", "ser", "dhav", "lxf", "rm", "apng",
)  # fmt: skip
"""Containers whose frames lie in the file itself. Playlists (`hls`, `concat`, `dash`), numbered images, devices and
streams are left out: they read other files, or the network."""
_CONTAINER_OPTIONS = _OPTIONS | {"protocol_whitelist": "file", "format_whitelist": ",".join(_FORMATS)}
_REFUSED = "expected a video in one file, found a playlist or a format that is not read; convert it to MP4"


def open_container(path: Path, where: str) -> InputContainer:
    """Open a file that holds its own frames.

    Args:
        path: the file.
        where: begins the message.

    Raises:
        RecordingError: it is a list of other files, or of a format that is not read.
        av.FFmpegError: it cannot be opened.
    """
    try:
        # Without its protocol, a name such as `concat:a|b` would be an address.
        return av.open(f"file:{path}", options=_CONTAINER_OPTIONS)
    except av.ArgumentError as error:
        raise RecordingError(f"{where}: {_REFUSED}") from error


class VideoDecoder:
    """A container and its decoder. Not safe to use from several threads.

    They end together. libav reads a null pointer where packets are asked of a container that has been closed, which
    ends the program; PyAV does not check it.
    """

    def __init__(self, path: Path, where: str) -> None:
        """Open a file before its first frame.

        Args:
            path: the file.
            where: begins the message.

        Raises:
            RecordingError: it has no video, frames that are too large, or is a list of other files.
            av.FFmpegError: it cannot be opened.
        """
        self._container = open_container(path, where)
        try:
            if not self._container.streams.video:
                raise RecordingError(f"{where}: expected a video, found a file without a video stream")
            self.stream = self._container.streams.video[0]
            """The first video stream."""
            if self.stream.codec_context is None:
                raise RecordingError(
                    f"{where}: expected a video that FFmpeg can decode, found another; convert it to MP4"
                )
            check_pixels((self.stream.codec_context.width, self.stream.codec_context.height), where)
            self.stream.codec_context.options = _OPTIONS
            # Frame threads would delay the output by as many frames; cameras are decoded in parallel anyway.
            self.stream.thread_type = "SLICE"
        except BaseException:
            self._container.close()
            raise
        self.tick_s = float(self.stream.time_base or 0)
        """Unit of time stamps, s."""
        self.has_b_frames = self.stream.codec_context.has_b_frames
        """Whether frames may be stored in another order than they are shown in."""
        self.frames = self._decode(self._container.demux(self.stream))
        """The frames from here on, in display order; damaged packets yield nothing."""

    def seek(self, pts: int) -> Packet | None:
        """Move to a time stamp, or before it; returns the first packet from there, or None if it cannot be reached."""
        try:
            self._container.seek(pts, stream=self.stream)
            packets = self._container.demux(self.stream)
            first = next(packets)
        except (av.FFmpegError, StopIteration):
            return None
        self.frames.close()
        self.frames = self._decode(chain([first], packets))
        return first

    def close(self) -> None:
        """Release the file. Nothing may be read afterwards."""
        self.frames.close()  # a closed generator reads nothing
        self._container.close()

    def _decode(self, packets: Iterable[Packet]) -> Generator[VideoFrame, None, None]:
        for packet in packets:
            try:
                yield from packet.decode()
            except av.InvalidDataError:
                continue


MAX_PASSED_BYTES = 128 * 2**20
"""Bound for all cameras of a recording together, bytes: 72 frames each of four cameras of 640x480, 10 of 1920x1080.

A group of n frames of which w fit is read backward by decoding (n / w + 1) / 2 frames for each frame: one if the group
fits, two for w = n / 3. No other choice of w frames costs less, because every pass begins at the key frame.
"""


class PassedFrames:
    """The frames passed last, as decoded (half the size of RGB), by presentation time stamp. Bounded in bytes."""

    def __init__(self, max_bytes: int) -> None:
        """Begin empty; a frame that is larger than `max_bytes` is not kept."""
        self._frames: OrderedDict[int, tuple[VideoFrame, int]] = OrderedDict()
        self._max_bytes, self.n_bytes = max_bytes, 0

    def keep(self, pts: int, frame: VideoFrame) -> None:
        """Keep a frame, and discard those passed first until the rest fits."""
        self._discard(pts)
        n_bytes = sum(plane.buffer_size for plane in frame.planes)
        self._frames[pts] = frame, n_bytes
        self.n_bytes += n_bytes
        while self.n_bytes > self._max_bytes:
            self._discard(next(iter(self._frames)))

    def get(self, pts: int) -> VideoFrame | None:
        """Return the frame with a time stamp if it is kept."""
        return self._frames.get(pts, (None, 0))[0]

    def _discard(self, pts: int) -> None:
        _, n_bytes = self._frames.pop(pts, (None, 0))
        self.n_bytes -= n_bytes


class FrameReader:
    """A decoder with its position and the frames that it passed. Not safe to use from several threads."""

    def __init__(self, path: Path, where: str, index: Index, passed_bytes: int) -> None:
        """Open a video before its first frame.

        Args:
            path: the file.
            where: begins messages.
            index: the frames listed so far.
            passed_bytes: bound on the frames kept for steps backward, bytes.

        Raises:
            RecordingError: as `VideoDecoder`.
            av.FFmpegError: as `VideoDecoder`.
        """
        self._path, self._where, self._index = path, where, index
        self._passed = PassedFrames(passed_bytes)
        self._decoder: VideoDecoder
        self._next: int | None
        """Number of the next frame that the decoder gives; None where it is unknown, so that the next read seeks."""
        self._complete_pts: int | None
        """Time stamp from which frames are complete; None where decoding began at the first frame."""
        self._open()

    def read(self, index: Index, k: int) -> VideoFrame | None:
        """Decode frame k; None if it is damaged.

        Args:
            index: the frames listed so far.
            k: number of a frame in the index.

        Raises:
            av.FFmpegError: the file cannot be read; the position is unknown then, so close the reader.
        """
        if self._index is not index:  # the position refers to the shorter list
            self._index, self._next = index, None
        passed = self._passed.get(int(index.pts[k]))
        if passed is not None:
            return passed
        if not self._reaches_soon(k):
            self._seek(self._best_key(k))
            frame = self._decode_until(k)
            if frame is not None:
                return frame
            # Some containers (MPEG program streams) lose the first time stamps after a seek: start earlier.
            self._seek(max(0, self._best_key(k) - 2))
        return self._decode_until(k)

    def close(self) -> None:
        """Release the file. Nothing may be read afterwards."""
        self._decoder.close()

    def _open(self) -> None:
        """Move the decoder before the first frame."""
        self._decoder = VideoDecoder(self._path, self._where)
        self._next, self._complete_pts = 0, None

    def _decode_until(self, k: int) -> VideoFrame | None:
        """Decode on to frame k, and keep the frames before it; None if it is damaged."""
        target = int(self._index.pts[k])
        for frame in self._decoder.frames:
            if frame.pts is None:  # the index has no such frame: the file is changing
                return None
            self._next = int(np.searchsorted(self._index.pts, frame.pts, side="right"))
            if frame.pts >= target:
                return frame if frame.pts == target and not frame.is_corrupt else None
            is_complete = self._complete_pts is None or frame.pts >= self._complete_pts
            if is_complete and not frame.is_corrupt:
                self._passed.keep(frame.pts, frame)
        return None

    def _best_key(self, k: int) -> int:
        """Return the index of the last key frame from which frame k decodes completely.

        That is the last one shown no later. A frame stored after a key frame but shown before it may depend on frames
        stored before the key frame.
        """
        return int(np.searchsorted(self._index.key_pts, self._index.pts[k], side="right")) - 1

    def _reaches_soon(self, k: int) -> bool:
        """Return whether decoding on from the current position is the shortest way to frame k."""
        if self._next is None or k < self._next:
            return False
        return self._next == k or self._index.key_pts[self._best_key(k)] <= self._index.pts[self._next]

    def _seek(self, best: int) -> None:
        """Move the decoder to a key frame, given by its index, or before it."""
        self._complete_pts = key = int(self._index.key_pts[best])  # frames shown before it may lack their references
        # Some containers land after the requested time; then request an earlier key frame.
        latest = self._index.position[key]
        for pts in self._index.key_pts[max(0, best - 2) : best + 1][::-1].tolist():
            first = self._decoder.seek(pts)
            if (
                first is not None
                and first.pts is not None
                and self._index.position.get(first.pts, latest + 1) <= latest
            ):
                return
        stuck = self._decoder
        self._open()
        stuck.close()


class DisplayTurn(NamedTuple):
    """A turn of the picture by quarters, with or without mirroring: first transpose, then mirror."""

    transposes: bool
    """Whether rows become columns."""
    mirrors_x: bool
    """Whether left and right are exchanged afterwards."""
    mirrors_y: bool
    """Whether top and bottom are exchanged afterwards."""

    @property
    def is_mirror(self) -> bool:
        """Whether no rotation gives the same picture."""
        return self.transposes ^ self.mirrors_x ^ self.mirrors_y


def display_turn(frame: VideoFrame) -> DisplayTurn:
    """Return the turn that a frame's display matrix is nearest to; none without a matrix.

    FFmpeg's matrix maps a pixel (x, y) to (a x + c y, b x + d y), with y downwards (libavutil/display.h).
    """
    data = frame.side_data.get("DISPLAYMATRIX")
    if data is None:
        return DisplayTurn(False, False, False)
    a, b, _, c, d = np.frombuffer(cast(bytes, data), np.int32)[:5].tolist()
    if abs(b) + abs(c) > abs(a) + abs(d):
        return DisplayTurn(True, c < 0, b < 0)
    return DisplayTurn(False, a < 0, d < 0)


def displayed_rgb(frame: VideoFrame, converter: VideoReformatter) -> Image:
    """Return a frame as displayed, (H, W, 3) RGB, by a converter that is kept: preparing one takes longer than using
    it."""
    image: Image = np.asarray(converter.reformat(frame, format="rgb24").to_ndarray(), np.uint8)
    turn = display_turn(frame)
    image = image.swapaxes(0, 1) if turn.transposes else image
    image = image[:, ::-1] if turn.mirrors_x else image
    return np.ascontiguousarray(image[::-1] if turn.mirrors_y else image)


def displayed_size(frame: VideoFrame) -> tuple[int, int]:
    """Return width and height of a frame as displayed, px."""
    return (frame.height, frame.width) if display_turn(frame).transposes else (frame.width, frame.height)
