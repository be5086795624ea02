"""Read what a calibration board looks like: Caliscope's `charuco.toml`, anipose's `config.toml`, or a plain file."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import cv2
import msgspec
import numpy as np
from msgspec import Meta

from tracker.errors import CalibrationError
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_toml
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD, check_usual
from tracker.validation import check

KIND = TextKind("board", DOCUMENT_BYTES, CalibrationError)
DICTIONARIES = tuple(sorted(n for n in dir(cv2.aruco) if n.startswith("DICT_")))
"""Names of the sets of markers that OpenCV knows."""
_MARKER_SHARE = 0.75
"""Side of a marker as a share of its square where a file does not state it: Caliscope's default."""

_Count: TypeAlias = Annotated[int, Meta(ge=2, le=100, description="a whole number from 2 to 100")]
_Length: TypeAlias = Annotated[float, Meta(gt=0, le=1e6, description="a length above 0")]
_Share: TypeAlias = Annotated[float, Meta(gt=0, lt=1, description="a share between 0 and 1")]
_Dictionary = Literal[DICTIONARIES]  # pyrefly: ignore[not-a-type]


@dataclass(frozen=True)
class Board:
    """A flat board of squares. A ChArUco board has a marker in each white square."""

    kind: Literal["charuco", "checkerboard"]
    columns: int
    """Squares along x, markers and all."""
    rows: int
    """Squares along y."""
    square_m: float
    """Side of a square, metres."""
    marker_share: float = _MARKER_SHARE
    """Side of a marker as a share of the square's."""
    dictionary: str = "DICT_4X4_50"
    """OpenCV's name of the set of markers."""
    inverted: bool = False
    """Whether black and white are exchanged."""
    legacy: bool = False
    """Whether an even number of rows begins as in OpenCV before 4.6."""

    @cached_property
    def corners(self) -> Array:
        """Inner corners on the board, (n, 3), metres, z = 0, row by row."""
        x, y = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        return self.square_m * np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3).astype(np.float64)

    @property
    def outline(self) -> Array:
        """Corners of the whole board, (4, 2), metres."""
        return self.square_m * np.array([[0, 0], [self.columns, 0], [self.columns, self.rows], [0, self.rows]], float)

    @property
    def words(self) -> str:
        """The board in words, for messages."""
        size = f"{self.columns} x {self.rows} squares"
        inverted = ", inverted" * self.inverted
        if self.kind == "checkerboard":
            return f"checkerboard of {size}{inverted}"
        return f"ChArUco board of {size} with {self.dictionary}{inverted}{', legacy pattern' * self.legacy}"


class _CaliscopeBoard(msgspec.Struct):
    """Caliscope's `charuco.toml`; it has other keys besides."""

    columns: _Count
    rows: _Count
    dictionary: _Dictionary
    square_size_override_cm: _Length | None = None
    aruco_scale: _Share = _MARKER_SHARE
    board_height: _Length | None = None
    board_width: _Length | None = None
    units: Literal["inch", "cm", "mm", "m"] = "inch"
    inverted: bool = False
    legacy_pattern: bool = False

    def __post_init__(self) -> None:
        if self.square_size_override_cm is None and (self.board_height is None or self.board_width is None):
            raise ValueError(
                "expected the measured side of a square as 'square_size_override_cm', found none; measure it"
            )

    def board(self) -> Board:
        """Return the board."""
        if self.square_size_override_cm is not None:
            square_m = METRES_BY_WORD["cm"] * self.square_size_override_cm
        else:
            assert self.board_height is not None
            assert self.board_width is not None
            square_m = METRES_BY_WORD[self.units] * min(self.board_height / self.rows, self.board_width / self.columns)
        return Board(
            "charuco", self.columns, self.rows, square_m, self.aruco_scale, self.dictionary, self.inverted,
            self.legacy_pattern,
        )  # fmt: skip


class _AniposeBoard(msgspec.Struct):
    """The section `calibration` of anipose's `config.toml`; lengths are millimetres."""

    board_type: Literal["charuco", "checkerboard"]
    board_size: tuple[_Count, _Count]
    board_square_side_length: _Length
    board_marker_length: _Length | None = None
    board_marker_bits: Annotated[int, Meta(ge=4, le=7)] = 4
    board_marker_dict_number: Annotated[int, Meta(ge=50, le=1000)] = 50

    def __post_init__(self) -> None:
        name = self._dictionary
        if name not in DICTIONARIES:
            raise ValueError(f"expected one of OpenCV's sets of markers, found {name}; correct board_marker_bits")
        if self.board_type == "charuco" and not (self.board_marker_length or 0) < self.board_square_side_length:
            raise ValueError("expected markers smaller than the squares, found larger ones")

    @property
    def _dictionary(self) -> str:
        return f"DICT_{self.board_marker_bits}X{self.board_marker_bits}_{self.board_marker_dict_number}"

    def board(self) -> Board:
        """Return the board. Anipose counts squares of ChArUco boards, and inner corners of checkerboards."""
        columns, rows = (n + (self.board_type == "checkerboard") for n in self.board_size)
        side = self.board_square_side_length
        share = self.board_marker_length / side if self.board_marker_length else _MARKER_SHARE
        return Board(self.board_type, columns, rows, METRES_BY_WORD["mm"] * side, share, self._dictionary)


class _PlainBoard(msgspec.Struct, forbid_unknown_fields=True):
    """The project's own form: a few lines that a person writes."""

    kind: Literal["charuco", "checkerboard"]
    columns: _Count
    rows: _Count
    square_mm: _Length
    marker_mm: _Length | None = None
    dictionary: _Dictionary | None = None
    inverted: bool = False
    legacy_pattern: bool = False

    def __post_init__(self) -> None:
        if self.kind == "charuco" and self.dictionary is None:
            raise ValueError("expected the set of markers as 'dictionary', found none; say for example DICT_4X4_50")
        if self.marker_mm is not None and self.marker_mm >= self.square_mm:
            raise ValueError("expected 'marker_mm' below 'square_mm', found a larger one")

    def board(self) -> Board:
        """Return the board."""
        share = self.marker_mm / self.square_mm if self.marker_mm else _MARKER_SHARE
        return Board(
            self.kind, self.columns, self.rows, METRES_BY_WORD["mm"] * self.square_mm, share,
            self.dictionary or "DICT_4X4_50", self.inverted, self.legacy_pattern,
        )  # fmt: skip


def read_board(path: str | Path, any_size: bool = False) -> Board:
    """Read the description of a board.

    Args:
        path: its file.
        any_size: whether to take squares of an unusual size.

    Raises:
        CalibrationError: the file is missing or malformed, or the orientation of the board is ambiguous.
    """
    return described_board(read_toml(Path(path), KIND), f"board {path}", any_size)


def described_board(data: dict[str, Any], where: str = "board", any_size: bool = False) -> Board:
    """Return the board of a description.

    Args:
        data: content of a file of one of the three forms.
        where: names the description in messages.
        any_size: whether to take squares of an unusual size.

    Raises:
        CalibrationError: the description is malformed, or the orientation of the board is ambiguous.
    """
    declared, section = _form_of(data)
    found: Board = check(section, declared, where, CalibrationError).board()
    if not any_size:
        unit = "centimetres" if declared is _CaliscopeBoard else "millimetres"
        side = float(f"{found.square_m / METRES_BY_WORD[unit]:.6g}")
        check_usual(side, "square", f"{where}: expected the side of a square", unit, CalibrationError)
    if found.kind == "checkerboard" and (found.columns + found.rows) % 2 == 0:
        raise CalibrationError(
            f"{where}: expected a checkerboard with an odd and an even number of squares, found {found.columns} x "
            f"{found.rows}, which looks the same turned by 180 degrees; cover one row, or use a ChArUco board"
        )
    return found


def _form_of(data: dict[str, Any]) -> tuple[Any, Any]:
    """Return the declaration of a file by its keys, and the section that it declares."""
    section = data.get("calibration")
    if isinstance(section, dict) and "board_type" in section:
        return _AniposeBoard, section
    if "board_type" in data:
        return _AniposeBoard, data
    if isinstance(data.get("charuco"), dict):
        return _CaliscopeBoard, data["charuco"]
    if data.keys() & {"aruco_scale", "square_size_override_cm", "board_height"}:
        return _CaliscopeBoard, data
    return _PlainBoard, data
