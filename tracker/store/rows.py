"""Convert records to rows of the store, and back."""

import json
from collections.abc import Sequence
from math import isfinite
from struct import iter_unpack
from typing import Any

import numpy as np

from tracker.geometry.arrays import Array
from tracker.store.records import SOURCES, STATUSES, Alternative, FramePose, FrameRow, PoseRecord

CURRENT_POSES = "FROM poses p JOIN pose_changes c ON c.id = p.change"
"""The current poses: their changes `c` with their keys `p`."""

RECORD_COLUMNS = (
    "c.numbers, c.sources, c.model_revision, c.keyframe, c.status, c.cost_px, coalesce(t.settings, c.settings), "
    "e.author, e.time, e.program, c.views_px, c.parts_px, c.remark, c.reviewed, c.limbs"
)
"""Columns that `row_to_record` reads; `e` is the edit, `t` the row of the settings."""
FRAME_ROW_COLUMNS = (
    "c.frame, c.sources, c.status, c.cost_px, c.keyframe, c.views_px, c.remark, c.reviewed, "
    "EXISTS (SELECT 1 FROM alternatives a WHERE a.change = c.id), c.limbs"
)
"""Columns that `row_to_frame_row` reads."""
FRAME_POSE_COLUMNS = "c.frame, c.numbers, c.cost_px, c.views_px, c.model_revision"
"""Columns that `row_to_frame_pose` reads."""
WRITTEN_COLUMNS = (
    "numbers, sources, keyframe, status, cost_px, model_revision, views_px, parts_px, remark, reviewed, "
    "limbs, program_settings"
)
"""Columns that `record_to_row` fills, and `program_settings`, the id of the row of the settings."""
ALTERNATIVE_COLUMNS = "a.numbers, a.model_revision, a.cost_px"
"""Columns that `row_to_alternative` reads; `a` is the alternative."""
UNMARKED_COLUMNS = (
    "numbers, sources, status, cost_px, model_revision, views_px, parts_px, remark, limbs, program_settings, settings"
)
"""Columns that marking a pose copies unchanged."""


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


def row_to_record(row: Sequence[Any]) -> PoseRecord:
    """Convert a row of `RECORD_COLUMNS`; the inverse of `record_to_row`."""
    numbers, sources, revision, keyframe, status, cost, settings, *rest = row
    author, time, program, views, parts, remark, seen, limbs = rest
    return PoseRecord(
        _array(numbers), tuple(SOURCES[i] for i in sources), revision, bool(keyframe), status, cost,
        json.loads(settings), author, time, program, _costs(views), _costs(parts), remark or "", bool(seen),
        _numbers(limbs),
    )  # fmt: skip


def row_to_frame_row(row: Sequence[Any]) -> FrameRow:
    """Convert a row of `FRAME_ROW_COLUMNS`."""
    frame, sources, status, cost, keyframe, views, remark, seen, others, limbs = row
    return FrameRow(
        frame, SOURCES[min(sources)], status, cost, bool(keyframe), _costs(views), remark or "", bool(keyframe or seen),
        bool(others and not keyframe), _numbers(limbs),
    )  # fmt: skip


def row_to_frame_pose(row: Sequence[Any]) -> FramePose:
    """Convert a row of `FRAME_POSE_COLUMNS`."""
    frame, numbers, cost, views, revision = row
    return FramePose(frame, _array(numbers), cost, _costs(views), revision)


def row_to_alternative(row: Sequence[Any]) -> Alternative:
    """Convert a row of `ALTERNATIVE_COLUMNS`; the inverse of `alternative_to_row`."""
    numbers, revision, cost = row
    return Alternative(_array(numbers), revision, cost)


def alternative_to_row(pose: Alternative) -> tuple[Any, ...]:
    """Convert an alternative to values of the columns numbers, model_revision and cost_px."""
    assert np.all(np.isfinite(pose.values))
    return np.asarray(pose.values, dtype="<f8").tobytes(), pose.model_revision, pose.cost_px


def record_to_row(pose: PoseRecord) -> tuple[Any, ...]:
    """Convert a pose to values of `WRITTEN_COLUMNS` except `program_settings`."""
    assert len(pose.sources) == len(pose.values)
    assert np.all(np.isfinite(pose.values))
    assert pose.status in STATUSES, pose.status
    return (
        np.asarray(pose.values, dtype="<f8").tobytes(),
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
    )


def _array(blob: bytes) -> Array:
    """Decode a read-only array."""
    values = np.frombuffer(blob, dtype="<f8").astype(np.float64)
    values.setflags(write=False)
    return values


def _blob(costs_px: Sequence[float | None]) -> bytes | None:
    """Encode costs: NaN for None, NULL for an empty sequence."""
    return np.array([np.nan if c is None else c for c in costs_px], dtype="<f8").tobytes() if costs_px else None


def _numbers(blob: bytes | None) -> tuple[float, ...]:
    """Decode numbers; the inverse of `_blob` where all are known."""
    return () if blob is None else tuple(number for (number,) in iter_unpack("<d", blob))


def _costs(blob: bytes | None) -> tuple[float | None, ...]:
    """Decode costs; the inverse of `_blob`."""
    return () if blob is None else tuple(c if isfinite(c) else None for (c,) in iter_unpack("<d", blob))
