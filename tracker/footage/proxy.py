"""Intra-frame proxies of footage: every frame is a picture of its own, so that any frame is shown at once.

A proxy is for display only; matching always uses the footage. A proxy folder has for each camera:

    NAME.mjpeg   the frames as JPEG, one after the other
    NAME.index   where each ends, uint64 little-endian; a frame that is damaged in the footage ends where it begins
    NAME.json    its source: path, size and time of change of the footage, and the number of frames

Each index entry is written after its picture, so that an interrupted program leaves a consistent proxy. The next run
cuts off what lies beyond the last entry and continues there.
"""

import json
import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np

from tracker.errors import RecordingError
from tracker.files import check_regular, open_regular, read_regular, write_text_atomic
from tracker.footage.frame_index import file_version_key
from tracker.footage.image_file import decode_image
from tracker.footage.video import Footage
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_json
from tracker.geometry.arrays import Image
from tracker.validation import check

FOLDER = "proxies"
VERSION = 1
"""Version of the files; with another one they are made again."""
_QUALITY = 88
"""JPEG's quality, of 100."""
_FLUSH_FRAMES = 100
"""Number of frames after which what is written goes to the disk, so that a crash costs no more."""
_END = np.dtype("<u8")
_KIND = TextKind("proxy", DOCUMENT_BYTES, RecordingError, "delete it")


class _About(msgspec.Struct):
    """The content of NAME.json."""

    version: int
    stamp: str
    n_frames: int


class Proxy:
    """The proxy of one camera, complete or not. Safe to use from several threads."""

    def __init__(self, folder: Path, camera: str) -> None:
        """Name a proxy without reading it."""
        self._pictures, self._index = folder / f"{camera}.mjpeg", folder / f"{camera}.index"
        self._about, self._camera = folder / f"{camera}.json", camera
        self._ends = np.empty(0, _END)

    def fits(self, footage: Path) -> bool:
        """Return whether it was made from this footage in its present version."""
        try:
            about: _About = check(read_json(self._about, _KIND), _About, f"proxy {self._about}", RecordingError)
        except RecordingError:
            return False
        return about.version == VERSION and about.stamp == file_version_key(footage)

    def follow(self, footage: Path) -> bool:
        """Keep the proxy for footage that has moved: same size and time of change. Returns whether it was kept."""
        try:
            about: _About = check(read_json(self._about, _KIND), _About, f"proxy {self._about}", RecordingError)
            stamp = file_version_key(footage)
            if about.version != VERSION or about.stamp.split("|")[-2:] != stamp.split("|")[-2:]:
                return False
            write_text_atomic(self._about, json.dumps({**msgspec.structs.asdict(about), "stamp": stamp}))
        except (RecordingError, OSError):  # no proxy, or none that can be kept: it is made again
            return False
        return True

    def exists(self) -> bool:
        """Return whether there is a proxy, of any footage."""
        return self._about.is_file()

    @property
    def n_frames(self) -> int:
        """Number of frames written so far."""
        try:
            return self._index.stat().st_size // _END.itemsize
        except OSError:
            return 0

    def read(self, k: int) -> Image | None:
        """Read frame k of the footage, (H, W, 3) RGB; None if it is damaged.

        Raises:
            RecordingError: there is no such frame, or the proxy cannot be read.
        """
        if k >= len(self._ends):
            self._ends = self._read_ends()
        if not 0 <= k < len(self._ends):
            raise RecordingError(f"camera '{self._camera}': the proxy has {len(self._ends)} frames, not frame {k}")
        begin, end = int(self._ends[k - 1]) if k else 0, int(self._ends[k])
        if begin == end:
            return None
        try:
            with open_regular(self._pictures) as file:
                file.seek(begin)
                data = file.read(end - begin)
        except OSError as error:
            raise RecordingError(f"cannot read {self._pictures}: {error.strerror}; delete it") from error
        image = decode_image(data, str(self._pictures))
        if image is None:
            raise RecordingError(f"{self._pictures} is damaged at frame {k}; delete it and run quadrille index again")
        return np.asarray(image, dtype=np.uint8)

    def make(self, path: Path, footage: Footage) -> Iterator[int]:
        """Write the missing frames, from the first one on. Pictures of other footage are discarded.

        Args:
            path: of the footage.
            footage: gives its frames.

        Yields:
            The number of frames written, after each. May be closed at any time.

        Raises:
            RecordingError: the proxy cannot be written, or the footage cannot be read.
        """
        try:
            self._about.parent.mkdir(parents=True, exist_ok=True)
            if not self.fits(path):
                self.remove()
                about = {"version": VERSION, "stamp": file_version_key(path), "n_frames": footage.n_frames}
                write_text_atomic(self._about, json.dumps(about))
            ends = self._read_ends()
            done, at = len(ends), int(ends[-1]) if len(ends) else 0
            yield done
            check_regular(self._pictures, self._index)
            with ExitStack() as files:
                pictures = files.enter_context(self._pictures.open("ab"))
                index = files.enter_context(self._index.open("ab"))
                pictures.truncate(at)
                index.truncate(done * _END.itemsize)
                for k in range(done, footage.n_frames):
                    image = footage.read(k)
                    data = b"" if image is None else _encoded(image)
                    pictures.write(data)
                    at += len(data)
                    if k % _FLUSH_FRAMES == 0:
                        pictures.flush()
                        os.fsync(pictures.fileno())
                    else:
                        pictures.flush()  # before the index entry
                    index.write(np.array(at, _END).tobytes())
                    index.flush()
                    yield k + 1
        except OSError as error:
            raise RecordingError(
                f"cannot write the proxy {self._pictures}: {error.strerror}; make room, or make the folder writable"
            ) from error

    def remove(self) -> None:
        """Delete the proxy."""
        for path in (self._about, self._index, self._pictures):
            path.unlink(missing_ok=True)

    def _read_ends(self) -> Any:
        """Read the ends of the frames that are complete."""
        try:
            n_bytes = self.n_frames * _END.itemsize
            ends = np.frombuffer(read_regular(self._index, n_bytes)[:n_bytes], _END)
            return ends[: int(np.searchsorted(ends, self._pictures.stat().st_size, side="right"))]
        except OSError:
            return np.empty(0, _END)


def _encoded(image: Image) -> bytes:
    done, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    assert done
    return bytes(data)
