"""Decode frame k of an opened video by random access."""

from pathlib import Path

import numpy as np
from av.video.frame import VideoFrame

from tracker.footage.frame_index import Index
from tracker.footage.passed_frames import PassedFrames
from tracker.footage.video_decoder import VideoDecoder


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
