"""A pose as a row of the store, both ways: `tracker.store.annotation_store` writes and reads by these."""

import json
from collections.abc import Sequence
from math import isfinite
from struct import iter_unpack
from typing import Any

import numpy as np

from tracker.geometry.arrays import Array
from tracker.store.records import SOURCES, STATUSES, Alternative, FrameNumbers, FrameRow, PoseRecord

SHOWN = "FROM poses p JOIN pose_changes c ON c.id = p.change"
"""The rows of the poses that the head of the history shows, `c`, with their key, `p`."""

RECORD = (
    "c.numbers, c.sources, c.model_revision, c.keyframe, c.status, c.cost_px, coalesce(t.settings, c.settings), "
    "e.author, e.time, e.program, c.views_px, c.parts_px, c.remark, c.reviewed"
)
"""Columns that `record_of` reads; `e` is the edit, `t` what its program was told."""
FRAME = (
    "c.frame, c.sources, c.status, c.cost_px, c.keyframe, c.views_px, c.remark, c.reviewed, "
    "EXISTS (SELECT 1 FROM alternatives a WHERE a.change = c.id)"
)
"""Columns that `frame_of` reads."""
NUMBERS = "c.frame, c.numbers, c.cost_px, c.views_px, c.model_revision"
"""Columns that `numbers_of` reads."""
CONTENT = "numbers, sources, keyframe, status, cost_px, model_revision, views_px, parts_px, remark, reviewed, told"
"""Columns that `content_of` writes, and `told`, which names what the program was told."""
ALTERNATIVE = "a.numbers, a.model_revision, a.cost_px"
"""Columns that `alternative_of` reads; `a` is the alternative."""
UNMARKED = "numbers, sources, status, cost_px, model_revision, views_px, parts_px, remark, told, settings"
"""Columns that stay as they are when a pose is marked."""


def record_of(row: Sequence[Any]) -> PoseRecord:
    """The pose of a row of `RECORD`."""
    numbers, sources, revision, keyframe, status, cost, settings, author, time, program, views, parts, remark, seen = (
        row
    )
    return PoseRecord(
        _array(numbers), tuple(SOURCES[i] for i in sources), revision, bool(keyframe), status, cost,
        json.loads(settings), author, time, program, _costs(views), _costs(parts), remark or "", bool(seen),
    )  # fmt: skip


def frame_of(row: Sequence[Any]) -> FrameRow:
    """What a row of `FRAME` says in short."""
    frame, sources, status, cost, keyframe, views, remark, seen, others = row
    return FrameRow(
        frame, SOURCES[min(sources)], status, cost, bool(keyframe), _costs(views), remark or "", bool(keyframe or seen),
        bool(others and not keyframe),
    )  # fmt: skip


def numbers_of(row: Sequence[Any]) -> FrameNumbers:
    """The numbers of a row of `NUMBERS`."""
    frame, numbers, cost, views, revision = row
    return FrameNumbers(frame, _array(numbers), cost, _costs(views), revision)


def alternative_of(row: Sequence[Any]) -> Alternative:
    """The other pose of a row of `ALTERNATIVE`."""
    numbers, revision, cost = row
    return Alternative(_array(numbers), revision, cost)


def alternative_content_of(pose: Alternative) -> tuple[Any, ...]:
    """What a row keeps of another pose: its numbers, model revision and cost."""
    assert np.all(np.isfinite(pose.values))
    return np.asarray(pose.values, dtype="<f8").tobytes(), pose.model_revision, pose.cost_px


def content_of(pose: PoseRecord) -> tuple[Any, ...]:
    """What a row keeps of a pose, in the order of `CONTENT`, without `told`."""
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
        _blob(pose.views_px),
        _blob(pose.parts_px),
        pose.remark,
        pose.reviewed,
    )


def _array(blob: bytes) -> Array:
    """Numbers as stored, not writable."""
    values = np.frombuffer(blob, dtype="<f8").astype(np.float64)
    values.setflags(write=False)
    return values


def _blob(costs_px: Sequence[float | None]) -> bytes | None:
    """Costs as stored: NaN for None, nothing where there are none."""
    return np.array([np.nan if c is None else c for c in costs_px], dtype="<f8").tobytes() if costs_px else None


def _costs(blob: bytes | None) -> tuple[float | None, ...]:
    """Costs from what is stored."""
    return () if blob is None else tuple(c if isfinite(c) else None for (c,) in iter_unpack("<d", blob))
