"""Declarations of the settings of a session, by name: they are checked on reading, as rows are.

The rooms that own a setting say what it means. Settings of the page alone, which fall back to defaults, are any JSON.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta

from tracker.errors import DamagedStoreError
from tracker.validation import MAX_FRAMES, ROUNDING, Name, Number, Vector, check

_Frame: TypeAlias = Annotated[int, Meta(ge=0, lt=MAX_FRAMES, description=f"a frame from 0 to {MAX_FRAMES - 1}")]
_FrameText: TypeAlias = Annotated[str, Meta(pattern=r"^[0-9]{1,8}\Z", description="the number of a frame")]
_Id: TypeAlias = Annotated[int, Meta(ge=1, le=2**62, description="the number of a row")]
_IdText: TypeAlias = Annotated[str, Meta(pattern=r"^[0-9]{1,19}\Z", description="the number of an edit")]
_Names: TypeAlias = Annotated[list[Name], Meta(max_length=1000)]
_Base64: TypeAlias = Annotated[str, Meta(pattern=r"^([A-Za-z0-9+/]{4})*([A-Za-z0-9+/]{2}==|[A-Za-z0-9+/]{3}=)?\Z")]
_Point: TypeAlias = tuple[Number, Number]


class _Axes(msgspec.Struct):
    frame: _Frame
    lines: dict[Name, list[list[tuple[_Point, _Point]]]]


class _Chain(msgspec.Struct):
    frame: _Frame
    done: list[Literal["backward", "forward"]]


class _Calibration(msgspec.Struct):
    toml: str
    time: str
    clocks: dict[Name, tuple[Number, Number]] = {}
    lost: dict[Name, list[tuple[int, int]]] = {}


class _Floor(msgspec.Struct):
    up: Literal["x", "y", "z", "-x", "-y", "-z"]
    normal: Vector | None = None
    offset_m: Number | None = None

    def __post_init__(self) -> None:
        if self.normal is not None and (self.offset_m is None or abs(math.hypot(*self.normal) - 1) > ROUNDING):
            raise ValueError("expected a unit vector as 'normal' with 'offset_m', found another plane")


class _SeenBody(msgspec.Struct):
    body: str
    points: _Names
    offsets_m: list[Vector]
    sigmas: list[Number]

    def __post_init__(self) -> None:
        if not len(self.points) == len(self.offsets_m) == len(self.sigmas):
            raise ValueError("expected an offset and a sigma for each point, found other numbers of them")


class _Unfinished(msgspec.Struct):
    task: Annotated[list[int | list[Any] | dict[str, Any]], Meta(min_length=5, max_length=6)]
    next: _Frame | None
    rows: dict[_IdText, dict[_FrameText, list[_Base64] | _Base64]] = {}

    def __post_init__(self) -> None:
        if not isinstance(self.task[-1], dict):
            raise ValueError("expected the settings of the tracker last in 'task', found none")


_DECLARATIONS: Mapping[str, Any] = {
    "store_id": Name,
    "locked": dict[Name, _Names],
    "sizes_edits": dict[_IdText, list[tuple[Name, _Id, _Id] | str | int]],
    "calibrations": list[_Calibration],
    "calibration_edits": dict[_IdText, tuple[_Id, _Id]],
    "calibrations_of_edits": dict[_IdText, _Id],
    "worked_together": bool,
    "taken_back": dict[_IdText, _Id],
    "confirmed_keyframes": dict[Name, dict[_FrameText, Annotated[int, Meta(ge=0, lt=2**32)]]],
    "silhouette_axes": _Axes | None,
    "find people": _Chain | None,
    "former_floor": _Floor | None,
    "unfinished track": _Unfinished | None,
    "seen bodies": dict[Name, dict[Name, _SeenBody]],
}
"""By name; others are any JSON."""


def checked_setting(name: str, value: Any) -> Any:
    """Return the value of a setting as it is stored, once it fits its declaration.

    Raises:
        DamagedStoreError: it does not.
    """
    check(value, _DECLARATIONS.get(name, Any), f"setting '{name}'", DamagedStoreError)
    return value
