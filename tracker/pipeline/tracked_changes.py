"""Convert pose estimates to rows of the store, write them, and read stored keyframes as input of a tracker."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple, Protocol

import numpy as np

from tracker.estimation.tracking.confidence import PoseQuality
from tracker.estimation.tracking.tracker import Keyframes, PoseEstimate, TrackerSettings
from tracker.geometry.arrays import Array
from tracker.session.session import Person
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, AssessmentChange, PoseChange, PoseRecord

_FIRST_METHOD = "chamfer"
"""The method of settings that name none: they are older than any other method."""


RunChange = PoseChange | AssessmentChange
"""A change by a run: a pose, or what is known about a keyframe."""


class PoseWriter(Protocol):
    """Stores the poses of a run."""

    def write(self, label: str, changes: Sequence[RunChange], edit: int | None) -> int | None:
        """Write poses, but leave keyframes as they are, and assessments.

        Args:
            label: of the entry of the history.
            changes: at least one.
            edit: the result of the last call; None at the first.

        Returns:
            The entry of the history that further poses of the run are added to.
        """


class StoreWriter:
    """Writes the poses of a run to a store at once."""

    def __init__(self, store: AnnotationStore) -> None:
        """Write to a store of annotations that is open."""
        self._store = store

    def write(self, label: str, changes: Sequence[RunChange], edit: int | None) -> int:
        """See `PoseWriter.write`.

        Raises:
            SessionError: the store cannot be written.
        """
        if edit is None:
            return self._store.commit(label, changes, by_program=True).edit
        self._store.amend(edit, changes, by_program=True)
        return edit


class StoredPerson(NamedTuple):
    """A person as the store knows them."""

    name: str
    revision: int
    """The body model of new poses."""


def tracked_changes(
    estimates: Sequence[PoseEstimate],
    stored: Sequence[StoredPerson],
    tracked: Sequence[int],
    keyframes: Keyframes,
    settings: TrackerSettings,
) -> list[PoseChange]:
    """Return the poses to store, without keyframes.

    Args:
        estimates: of any frames.
        stored: all people.
        tracked: indices of the people whose poses are stored.
        keyframes: poses that the tracker took as they are; they stay in the store.
        settings: of the tracker.
    """
    record = settings_record(settings)
    return [
        PoseChange(
            stored[i].name,
            found.frame,
            PoseRecord(
                found.poses[i],
                ("tracked",) * len(found.poses[i]),
                stored[i].revision,
                status=found.statuses[i],
                cost_px=number(found.cost_px),
                settings=record,
                view_costs_px=numbers(found.view_costs_px),
                part_costs_px=numbers(found.part_costs_px[i]),
                remark=found.notes[i],
                limbs_lost=_limbs_lost(found.qualities[i]),
                trace=found.traces[i] if found.traces else None,
            ),
            tuple(Alternative(o.values, stored[i].revision, number(o.cost_px)) for o in found.alternatives[i]),
        )
        for found in estimates
        for i in tracked
        if i not in keyframes.get(found.frame, {})
    ]


def keyframes_of(
    store: AnnotationStore, people: Sequence[Person], frames: Collection[int], fixed: Collection[int] = ()
) -> dict[int, dict[int, Array]]:
    """Return the poses of the keyframes among some frames, by frame and index of the person.

    Poses of a body with another number of values are left out.

    Args:
        store: annotations of the session.
        people: of the session.
        frames: that are looked at.
        fixed: indices of people all of whose poses are taken, because nobody tracks them.
    """
    keyframes: dict[int, dict[int, Array]] = {}
    for index, person in enumerate(people):
        for row in store.frames(person.name):
            is_taken = row.frame in frames and (row.keyframe or index in fixed)
            record = store.pose(person.name, row.frame) if is_taken else None
            if record is not None and len(record.values) == len(person.model.value_names):
                keyframes.setdefault(row.frame, {})[index] = record.values
    return keyframes


def settings_record(settings: TrackerSettings) -> dict[str, Any]:
    """Return a tracker's settings and method as the store keeps them: values that JSON can hold."""
    return {"method": settings.method, **asdict(settings)}


def recorded_method(record: Mapping[str, Any]) -> str:
    """Return the method that stored settings name."""
    return str(record.get("method", _FIRST_METHOD))


def _limbs_lost(quality: PoseQuality | None) -> tuple[float, ...]:
    """Return the probability that each limb is lost; empty where not assessed."""
    return () if quality is None else tuple(map(float, quality.lost_probabilities))


def number(value: float) -> float | None:
    """Return None for NaN and infinity, which JSON cannot hold."""
    return float(value) if np.isfinite(value) else None


def numbers(values: Array) -> tuple[float | None, ...]:
    """Return `number` of each of some values, (n,)."""
    return tuple(map(number, values))
