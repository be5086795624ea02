"""Convert pose estimates to rows of the store, write them, and read stored keyframes as input of a tracker.

Rows of the store for poses that were estimated from all frames of a run.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.tracking.confidence import (
    PoseQuality,
    classify_limbs,
    may_be_elsewhere,
    probabilities,
    uncertain,
    without_uncertainty,
)
from tracker.estimation.tracking.pose_errors import elsewhere_odds, even_odds, limb_odds, mass_odds, point_covariances
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


def assessed_by_run(model: BodyModel, pose: PoseRecord, found: RunPose) -> PoseRecord:
    """Return a pose with its cost, the errors of its points, and the status that follows from what else it may be.

    Args:
        model: the body.
        pose: the pose.
        found: what all frames of the run say about it.
    """
    errors = point_covariances(model, found.errors_m2)
    n = len(limbs(model))
    searched = [found.is_searched and len(limb.parts) > 1 for limb in limbs(model)]
    shares = ["" if found.others else f": elsewhere on {100 * m:.0f}% of the likely paths" for m in found.elsewhere]
    evidence = (
        (limb_odds(model, errors), [""] * n),
        (mass_odds(found.elsewhere), shares),  # the remark on others says so, too
        (elsewhere_odds(found.by_colors, searched), [f": {against}" for against in found.against]),
        (even_odds(found.is_shown), [": fewer than two views show it"] * n),
        (even_odds(np.full(n, found.is_facing_sure)), [": contours do not tell which way the person faces"] * n),
    )
    odds = np.stack([of_limbs for of_limbs, _ in evidence])
    reasons = [evidence[source][1][i] for i, source in enumerate(odds[:, :, 0].argmax(axis=0))]
    remarks = without_uncertainty(pose.remark, alternatives=True)
    if found.others:
        remarks.append(may_be_elsewhere(PosedBody(model, pose.values), found.others))
    odds = odds.max(axis=0)
    status, worst = classify_limbs(odds), int(odds[:, 1].argmax())
    if status != "good" and (reasons[worst] or not remarks):
        remarks = [uncertain(limbs(model)[worst].name, reasons[worst]), *remarks]
    lost = tuple(map(float, probabilities(odds[:, 1])))
    return replace(
        pose, errors=errors, status=status, limbs_lost=lost, remark=", ".join(remarks), cost_px=number(found.cost_px),
        view_costs_px=tuple(map(number, found.view_costs_px)),
    )  # fmt: skip


def estimated_row(
    model: BodyModel, before: PoseRecord | None, found: RunPose, revision: int, settings: Mapping[str, Any]
) -> PoseRecord:
    """Return the record of an estimated pose: its values, its own costs, and its status.

    Args:
        model: the body.
        before: the pose on that frame by the first pass, or the stored one that a run goes out from.
        found: the estimate.
        revision: of the body.
        settings: record of the settings of the run.
    """
    if before is None:
        before = PoseRecord(found.pose, ("tracked",) * len(found.pose), revision, settings=settings)
    searches = () if found.entry is None else (found.entry,)
    pose = replace(
        before,
        values=found.pose,
        model_revision=revision,
        part_costs_px=numbers(found.part_costs_px),
        trace=(*(x for x in before.trace or () if x.kind != "path"), *searches),
    )
    return assessed_by_run(model, pose, found)


def pose_change(name: str, frame: int, row: PoseRecord, found: RunPose, revision: int) -> PoseChange:
    """Return what stores the pose of a person with its alternatives, which are in a revision of the body."""
    return PoseChange(name, frame, row, tuple(Alternative(h.pose, revision) for h in found.others))


def assessed_keyframe(model: BodyModel, name: str, frame: int, keyframe: Array, found: RunPose) -> AssessmentChange:
    """Return what the frames of a run say about a keyframe of a person, (n_values,), which stays."""
    pose = PoseRecord(keyframe, ("manual",) * len(keyframe), 0)
    return AssessmentChange.of(name, frame, assessed_by_run(model, pose, found))
