"""The declaration of session.toml: its keys, types and ranges."""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, get_args

import msgspec
import numpy as np
from msgspec import Meta

from tracker.errors import SessionError
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_toml
from tracker.validation import (
    MAX_FRAMES,
    Color,
    FilePath,
    FileStem,
    FrameRate,
    Name,
    Number,
    Vector,
    check,
    check_version,
)

VERSION = 6
"""Newest version. A session is written in the oldest version that can describe it, so that older programs can read it:
version 2 has a floor, version 3 a camera with a `declared_fps`, version 4 one with `footage_frames`, version 5 one with
`time_offset_s` or `time_rate`, version 6 one with `lost_frames`."""

Up: TypeAlias = Literal["x", "-x", "y", "-y", "z", "-z"]
UPS: tuple[str, ...] = get_args(Up)

_KIND = TextKind("session", DOCUMENT_BYTES, SessionError, "correct it or make a new session")

_PersonName: TypeAlias = Annotated[
    str,
    Meta(
        pattern=r"^\w[\w .-]{0,99}\Z",
        description="a person's name of at most 100 letters, digits, spaces, dots, '-' and '_'",
    ),
]
"""The name becomes the name of a file, so it must not lead out of the folder."""
_FrameCount: TypeAlias = Annotated[
    int,
    Meta(
        ge=1,
        le=MAX_FRAMES,
        description=f"a whole number of frames from 1 to {MAX_FRAMES} (check the footage and the offsets)",
    ),
]
_Frame: TypeAlias = Annotated[int, Meta(ge=1, le=MAX_FRAMES, description="a frame from 1 on")]
_Lost: TypeAlias = Annotated[
    int, Meta(ge=-MAX_FRAMES, le=MAX_FRAMES, description="a whole number of frames; negative where pictures are double")
]


class _Row(msgspec.Struct, forbid_unknown_fields=True):
    """A table of session.toml."""


class CameraRow(_Row):
    """A camera and its footage."""

    name: FileStem
    footage: FilePath
    background: FilePath | None = None
    masks: FilePath | None = None
    offset: Annotated[
        int, Meta(ge=-MAX_FRAMES, le=MAX_FRAMES, description=f"a whole number of frames, at most {MAX_FRAMES},")
    ] = 0
    declared_fps: FrameRate | None = None
    footage_frames: _FrameCount | None = None
    # Whole frames are in `offset`. More than a tenth of a second per second would be another frame rate.
    time_offset_s: Annotated[float, Meta(ge=-1, le=1, description="a time from -1 to 1 s")] = 0.0
    time_rate: Annotated[float, Meta(ge=-0.1, le=0.1, description="a drift from -0.1 to 0.1 s per s")] = 0.0
    lost_frames: list[tuple[_Frame, _Lost]] = []

    def __post_init__(self) -> None:
        if self.offset < 0:
            raise ValueError(
                f"expected 0 or more as 'offset', found {self.offset}; "
                f"give each of the others an offset of {-self.offset} instead"
            )
        since = [frame for frame, _ in self.lost_frames]
        if since != sorted(set(since)):
            raise ValueError(
                f"expected a later frame in each row of 'lost_frames', found frames {', '.join(map(str, since))}; put "
                "them in order, and add those of one frame"
            )


class PersonRow(_Row):
    """A person, with the file of the body model."""

    name: _PersonName
    model: FilePath
    color: Color


class FloorRow(_Row):
    """The floor: the points x with `normal . x = offset_m`."""

    normal: Vector
    offset_m: Number

    def __post_init__(self) -> None:
        if np.linalg.norm(self.normal) < 1e-6:
            raise ValueError("expected a direction as 'normal', found three numbers that are almost 0")


class SessionFile(_Row):
    """The content of session.toml."""

    version: int
    name: Name
    fps: FrameRate
    n_frames: _FrameCount
    up: Annotated[Up, Meta(description=f"the axis that points up, one of {', '.join(UPS)},")]
    calibration: FilePath
    cameras: Annotated[list[CameraRow], Meta(min_length=1, max_length=256, description="at least one camera")]
    people: Annotated[list[PersonRow], Meta(min_length=1, max_length=64, description="at least one person")]
    floor: FloorRow | None = None

    def __post_init__(self) -> None:
        for what, rows in (("camera", self.cameras), ("person", self.people)):
            name, count = Counter(row.name for row in rows).most_common(1)[0]
            if count > 1:
                raise ValueError(f"expected a name of its own for each {what}, found more than one '{name}'")


def read_session_file(path: Path) -> SessionFile:
    """Read session.toml.

    Raises:
        SessionError: the file is missing, malformed or newer than this program.
    """
    data = read_toml(path, _KIND)
    where = f"session {path}"
    check_version(data, VERSION, where, SessionError)
    return checked(data, where)


def needed_version(data: dict[str, Any]) -> int:
    """Return the oldest version that can describe the content of a session file."""
    if any("lost_frames" in row for row in data["cameras"]):
        return 6
    if any("time_offset_s" in row or "time_rate" in row for row in data["cameras"]):
        return 5
    if any("footage_frames" in row for row in data["cameras"]):
        return 4
    if any("declared_fps" in row for row in data["cameras"]):
        return 3
    return 2 if "floor" in data else 1


def checked(data: Any, where: str) -> SessionFile:
    """Check the content of a session file, which `where` names in messages.

    Raises:
        SessionError: it does not fit the declaration.
    """
    content: SessionFile = check(data, SessionFile, where, SessionError)
    return content
