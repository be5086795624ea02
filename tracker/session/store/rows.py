"""Convert records to rows of the store, and back. Rows are checked: a file from elsewhere may hold anything."""

import json
from collections.abc import Sequence
from math import isfinite
from struct import iter_unpack
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta

from tracker.body.limbs import Search
from tracker.errors import DamagedStoreError
from tracker.geometry.arrays import Array
from tracker.session.store.records import (
    SOURCES,
    STATUSES,
    Alternative,
    AssessmentChange,
    FramePose,
    FrameRow,
    HistoryEntry,
    ModelRevision,
    Pin,
    PoseRecord,
    RowId,
)
from tracker.validation import MAX_FRAMES, Number, Time, check

_Flag: TypeAlias = Annotated[int, Meta(ge=0, le=1, description="0 or 1")]
_Frame: TypeAlias = Annotated[int, Meta(ge=0, lt=MAX_FRAMES, description=f"a frame from 0 to {MAX_FRAMES - 1}")]
_Status: TypeAlias = Literal["", "good", "doubtful", "lost"]
_Numbers: TypeAlias = Annotated[bytes, Meta(min_length=8, description="the bytes of numbers")]


class PoseLabel(NamedTuple):
    """Names a pose in messages."""

    person: str
    frame: Any

    def __str__(self) -> str:
        return f"the pose of {self.person!r:.60} in frame {self.frame!r:.20}"


class _Summary(msgspec.Struct):
    """Fields that all rows of poses share, by the names of their columns."""

    frame: _Frame
    sources: Annotated[bytes, Meta(min_length=1)]
    status: _Status
    cost_px: Number | None
    keyframe: _Flag
    view_costs_px: bytes | None
    remark: str | None
    reviewed: _Flag | None
    others: _Flag
    limbs: bytes | None
    assessed_since: _Flag
    change: RowId


class _Pose(msgspec.Struct):
    numbers: _Numbers
    sources: Annotated[bytes, Meta(min_length=1)]
    model_revision: RowId
    keyframe: _Flag
    status: _Status
    cost_px: Number | None
    settings: str
    author: str
    time: Time
    program: str
    view_costs_px: bytes | None
    part_costs_px: bytes | None
    remark: str | None
    reviewed: _Flag | None
    limbs: bytes | None
    errors: bytes | None
    trace: str | None


class _FramePose(msgspec.Struct):
    frame: _Frame
    numbers: _Numbers
    cost_px: Number | None
    view_costs_px: bytes | None
    model_revision: RowId


class _Alternative(msgspec.Struct):
    numbers: _Numbers
    model_revision: RowId
    cost_px: Number | None


class _Pin(msgspec.Struct):
    point: str
    camera: str
    u: Number
    v: Number


CURRENT_POSES = "FROM poses p JOIN pose_changes c ON c.id = p.change"
"""The current poses: their changes `c` with their keys `p`."""
ORIGIN = "JOIN edits e ON e.id = coalesce(c.made_in, c.edit) LEFT JOIN program_settings t ON t.id = c.program_settings"
"""The edit `e` that made the pose of a change `c`, and the row `t` of its settings."""
ALTERNATIVES = "FROM alternatives a JOIN pose_changes c ON c.id = a.change"
"""All alternatives `a` with the changes `c` that they belong to."""

RECORD_COLUMNS = (
    "c.numbers, c.sources, c.model_revision, c.keyframe, c.status, c.cost_px, coalesce(t.settings, c.settings), "
    "e.author, e.time, e.program, c.views_px, c.parts_px, c.remark, c.reviewed, c.limbs, "
    "c.errors, c.trace"
)
"""Columns that `row_to_record` reads; `e` and `t` are those of `ORIGIN`."""
FRAME_ROW_COLUMNS = (
    "c.frame, c.sources, c.status, c.cost_px, c.keyframe, c.views_px, c.remark, c.reviewed, "
    "EXISTS (SELECT 1 FROM alternatives a WHERE a.change = c.id), c.limbs, c.made_in IS NOT NULL, c.id"
)
"""Columns that `row_to_frame_row` reads."""
FRAME_POSE_COLUMNS = "c.frame, c.numbers, c.cost_px, c.views_px, c.model_revision"
"""Columns that `row_to_frame_pose` reads."""
WRITTEN_COLUMNS = (
    "numbers, sources, keyframe, status, cost_px, model_revision, views_px, parts_px, remark, reviewed, "
    "limbs, errors, trace, program_settings"
)
"""Columns that `record_to_row` fills, and `program_settings`, the id of the row of the settings."""
ALTERNATIVE_COLUMNS = "a.numbers, a.model_revision, a.cost_px"
"""Columns that `row_to_alternative` reads; `a` is the alternative."""
_POSE_COLUMNS = "numbers, sources, model_revision, parts_px, trace, program_settings, settings"
ASSESSED_COLUMNS = "status, remark, limbs, errors, cost_px, views_px"
"""Columns that an assessment of a pose fills; see `assessment_to_row`."""
UNMARKED_COLUMNS = f"{_POSE_COLUMNS}, {ASSESSED_COLUMNS}"
"""Columns that marking a pose copies unchanged."""
UNASSESSED_COLUMNS = f"{_POSE_COLUMNS}, keyframe, reviewed"
"""Columns that assessing a pose copies unchanged."""


def is_readable(numbers: Any, sources: Any) -> bool:
    """Return whether a pose of a store without checksums can be read: its numbers and their sources, or neither."""
    if numbers is None:
        return True
    return (
        isinstance(numbers, bytes)
        and isinstance(sources, bytes)
        and len(numbers) == 8 * len(sources) > 0
        and max(sources) < len(SOURCES)
        and bool(np.isfinite(np.frombuffer(numbers, dtype="<f8")).all())
    )


def row_to_record(row: Sequence[Any], where: object) -> PoseRecord:
    """Convert a row of `RECORD_COLUMNS`; the inverse of `record_to_row`. Raises as all of these do.

    Args:
        row: of the store.
        where: names the row in messages, as text that is made when it is needed.

    Raises:
        DamagedStoreError: a value is impossible.
    """
    pose: _Pose = _checked(row, _Pose, where)
    values, sources = _array(pose.numbers, where), _sources(pose.sources, where)
    if len(sources) != len(values):
        raise DamagedStoreError(f"{where}: expected a source for each of {len(values)} values, found {len(sources)}")
    return PoseRecord(
        values, sources, pose.model_revision, bool(pose.keyframe), pose.status, pose.cost_px,
        settings(pose.settings, where),
        pose.author, pose.time, pose.program, _costs(pose.view_costs_px, where), _costs(pose.part_costs_px, where),
        pose.remark or "", bool(pose.reviewed), _numbers(pose.limbs, where), _covariances(pose.errors, where),
        _trace(pose.trace, where),
    )  # fmt: skip


def row_to_frame_row(row: Sequence[Any], where: object) -> FrameRow:
    """Convert a row of `FRAME_ROW_COLUMNS`."""
    summary: _Summary = _checked(row, _Summary, where)
    return FrameRow(
        summary.frame, SOURCES[min(_known(summary.sources, where))], summary.status, summary.cost_px,
        bool(summary.keyframe), _costs(summary.view_costs_px, where), summary.remark or "",
        bool(summary.keyframe or summary.reviewed), bool(summary.others and not summary.keyframe),
        _numbers(summary.limbs, where), bool(summary.assessed_since), summary.change,
    )  # fmt: skip


def row_to_frame_pose(row: Sequence[Any], where: object) -> FramePose:
    """Convert a row of `FRAME_POSE_COLUMNS`."""
    pose: _FramePose = _checked(row, _FramePose, where)
    costs_px = _costs(pose.view_costs_px, where)
    return FramePose(pose.frame, _array(pose.numbers, where), pose.cost_px, costs_px, pose.model_revision)


def row_to_alternative(row: Sequence[Any], where: object) -> Alternative:
    """Convert a row of `ALTERNATIVE_COLUMNS`; the inverse of `alternative_to_row`."""
    alternative: _Alternative = _checked(row, _Alternative, where)
    return Alternative(_array(alternative.numbers, where), alternative.model_revision, alternative.cost_px)


def row_to_pin(row: Sequence[Any], where: object) -> Pin:
    """Convert the columns point, camera, u and v."""
    pin: _Pin = _checked(row, _Pin, where)
    return Pin(pin.point, pin.camera, (pin.u, pin.v))


def row_to_entry(row: Sequence[Any]) -> HistoryEntry:
    """Convert the columns id, label, author and time of an edit that is not undone."""
    entry: HistoryEntry = check(list(row), HistoryEntry, f"edit {row[0]!r:.40}", DamagedStoreError)
    return entry


def row_to_revision(row: Sequence[Any]) -> ModelRevision:
    """Convert the columns id, person, toml and time."""
    revision: ModelRevision = check(list(row), ModelRevision, f"model revision {row[0]!r:.40}", DamagedStoreError)
    return revision


def settings(text: Any, where: object) -> dict[str, Any]:
    """Decode the settings that made a pose, checked."""
    return check(decoded_json(text, where), dict[str, Any], f"{where}, settings", DamagedStoreError)


def frame_number(value: Any, where: object) -> int:
    """Return a frame, checked."""
    if type(value) is int and 0 <= value < MAX_FRAMES:  # no name of the row is made for each of many
        return value
    return int(check(value, _Frame, f"{where}, frame", DamagedStoreError))


def decoded_json(text: Any, where: object) -> Any:
    """Decode JSON text of a row."""
    try:
        return json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise DamagedStoreError(f"{where}: expected JSON text, found {text!r:.60}") from error


def _checked(row: Sequence[Any], declaration: Any, where: object) -> Any:
    named = dict(zip(declaration.__struct_fields__, row, strict=True))
    try:
        return msgspec.convert(named, declaration)
    except msgspec.ValidationError:
        return check(named, declaration, str(where), DamagedStoreError)


def _sources(blob: bytes, where: object) -> tuple[str, ...]:
    return tuple(SOURCES[i] for i in _known(blob, where))


def _known(blob: bytes, where: object) -> bytes:
    """Return indices of sources, checked."""
    if max(blob) >= len(SOURCES):
        raise DamagedStoreError(f"{where}: expected sources from 0 to {len(SOURCES) - 1}, found {max(blob)}")
    return blob


def alternative_to_row(pose: Alternative) -> tuple[Any, ...]:
    """Convert an alternative to values of the columns numbers, model_revision and cost_px."""
    assert np.all(np.isfinite(pose.values))
    return values_to_blob(pose.values), pose.model_revision, pose.cost_px


def record_to_row(pose: PoseRecord) -> tuple[Any, ...]:
    """Convert a pose to values of `WRITTEN_COLUMNS` except `program_settings`."""
    assert len(pose.sources) == len(pose.values)
    assert np.all(np.isfinite(pose.values))
    assert pose.status in STATUSES, pose.status
    return (
        values_to_blob(pose.values),
        bytes(SOURCES.index(s) for s in pose.sources),
        pose.keyframe,
        pose.status,
        pose.cost_px,
        pose.model_revision,
        _blob(pose.view_costs_px),
        _blob(pose.part_costs_px),
        pose.remark,
        pose.reviewed,
        _blob(pose.limbs_lost),
        _triangles(pose.errors),
        None if pose.trace is None else json.dumps(pose.trace, separators=(",", ":")),
    )


def assessment_to_row(assessed: AssessmentChange) -> tuple[Any, ...]:
    """Convert an assessment to values of `ASSESSED_COLUMNS`."""
    assert assessed.status in STATUSES, assessed.status
    costs = assessed.cost_px, None if assessed.cost_px is None else _blob(assessed.view_costs_px)
    return assessed.status, assessed.remark, _blob(assessed.limbs_lost), _triangles(assessed.errors), *costs


def values_to_blob(values: Array) -> bytes:
    """Encode the values of a pose."""
    return np.asarray(values, dtype="<f8").tobytes()


def _trace(text: str | None, where: object) -> tuple[Search, ...] | None:
    if text is None:
        return None
    searches = check(decoded_json(text, where), list[Search], f"{where}, searches", DamagedStoreError)
    return tuple(searches)


def _triangles(errors: Array | None) -> bytes | None:
    return None if errors is None else errors[(..., *np.triu_indices(3))].astype("<f4").tobytes()


def _array(blob: bytes, where: object) -> Array:
    """Decode a read-only array of finite numbers."""
    values = np.frombuffer(_whole(blob, where), dtype="<f8").astype(np.float64)
    if not np.isfinite(values).all():
        raise DamagedStoreError(f"{where}: expected finite values, found {values[~np.isfinite(values)][0]}")
    values.setflags(write=False)
    return values


def _covariances(blob: bytes | None, where: object) -> Array | None:
    """Decode covariances, (n, 3, 3)."""
    if blob is None:
        return None
    if len(blob) % 24:
        raise DamagedStoreError(f"{where}: expected covariances of 24 bytes, found {len(blob)} bytes")
    triangles = np.frombuffer(blob, dtype="<f4").reshape(-1, 6)
    if not np.isfinite(triangles).all():
        raise DamagedStoreError(f"{where}: expected finite covariances, found {triangles[~np.isfinite(triangles)][0]}")
    out = np.empty((len(triangles), 3, 3))
    rows, columns = np.triu_indices(3)
    out[:, rows, columns] = out[:, columns, rows] = triangles
    return out


def _whole(blob: bytes, where: object) -> bytes:
    if len(blob) % 8:
        raise DamagedStoreError(f"{where}: expected numbers of 8 bytes, found {len(blob)} bytes")
    return blob


def _blob(costs_px: Sequence[float | None]) -> bytes | None:
    """Encode costs: NaN for None, NULL for an empty sequence."""
    return np.array([np.nan if c is None else c for c in costs_px], dtype="<f8").tobytes() if costs_px else None


def _numbers(blob: bytes | None, where: object) -> tuple[float, ...]:
    """Decode numbers; the inverse of `_blob` where all are known."""
    values = () if blob is None else tuple(number for (number,) in iter_unpack("<d", _whole(blob, where)))
    if not all(map(isfinite, values)):
        raise DamagedStoreError(f"{where}: expected finite numbers, found {values!r:.60}")
    return values


def _costs(blob: bytes | None, where: object) -> tuple[float | None, ...]:
    """Decode costs; the inverse of `_blob`."""
    values = () if blob is None else iter_unpack("<d", _whole(blob, where))
    return tuple(c if isfinite(c) else None for (c,) in values)
