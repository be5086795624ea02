"""Rows of the store for poses that were estimated from all frames of a run."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tracker.body.model import BodyModel
from tracker.estimation.runs.path_assessment import RunPose
from tracker.geometry.arrays import Array
from tracker.pipeline.assessed_poses import assessed_by_run
from tracker.pipeline.tracked_changes import numbers
from tracker.session.store.records import Alternative, AssessmentChange, PoseChange, PoseRecord


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
