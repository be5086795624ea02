"""What a tracker has found, as rows of the store."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from tracker.geometry.arrays import Array
from tracker.session.session import Person
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import Alternative, PoseChange, PoseRecord
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import PoseEstimate

Keyframes = Mapping[int, Mapping[int, Array]]
"""Poses that a tracker takes as they are, by frame and index of the person."""


def tracked_changes(
    estimates: Sequence[PoseEstimate],
    names: Sequence[str],
    people: Sequence[int],
    revisions: Sequence[int],
    fixed: Keyframes,
    settings: TrackSettings,
) -> list[PoseChange]:
    """Poses to store, but for the keyframes that the tracker was given.

    Args:
        estimates: what it found.
        names: of all people.
        people: indices of those it tracked.
        revisions: body model of each person.
        fixed: keyframes on its way.
        settings: what it was told.
    """
    told = told_of(settings)
    return [
        PoseChange(
            names[i],
            found.frame,
            PoseRecord(
                found.poses[i],
                ("tracked",) * len(found.poses[i]),
                revisions[i],
                status=found.statuses[i],
                cost_px=_number(found.cost_px),
                settings=told,
                views_px=tuple(_number(c) for c in found.views_px),
                parts_px=tuple(_number(c) for c in found.parts_px[i]),
                remark=found.remarks[i],
            ),
            tuple(Alternative(o.values, revisions[i], _number(o.cost_px)) for o in found.alternatives[i]),
        )
        for found in estimates
        for i in people
        if i not in fixed.get(found.frame, {})
    ]


def keyframes_of(
    store: AnnotationStore, people: Sequence[Person], frames: Collection[int]
) -> dict[int, dict[int, Array]]:
    """Poses of the keyframes among some frames, by frame and index of the person."""
    found: dict[int, dict[int, Array]] = {}
    for index, person in enumerate(people):
        for row in store.frames(person.name):
            record = store.pose(person.name, row.frame) if row.keyframe and row.frame in frames else None
            if record is not None and len(record.values) == len(person.model.value_names):
                found.setdefault(row.frame, {})[index] = record.values
    return found


def told_of(settings: TrackSettings) -> dict[str, Any]:
    """A tracker's settings as the store keeps them."""
    return {"method": "chamfer", **asdict(settings)}


def _number(value: float) -> float | None:
    """None where a number is NaN or infinite, as JSON wants it."""
    return float(value) if np.isfinite(value) else None
