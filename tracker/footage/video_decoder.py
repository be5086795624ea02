"""One opened video file, decoded from one place on."""

from collections.abc import Generator, Iterable
from itertools import chain
from pathlib import Path

import av
from av.container import InputContainer
from av.packet import Packet
from av.video.frame import VideoFrame

from tracker.errors import RecordingError
from tracker.footage.image_file import MAX_PIXELS, check_pixels

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
