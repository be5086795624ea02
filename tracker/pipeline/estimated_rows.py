"""Rows of the store for poses that were estimated from all frames of a run."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.tracking.confidence import classify_limbs, probabilities
from tracker.estimation.tracking.pose_errors import (
    elsewhere_odds,
    even_odds,
    limb_odds,
    mass_odds,
    point_covariances,
)
from tracker.estimation.tracking.remarks import may_be_elsewhere, uncertain, without_uncertainty
from tracker.geometry.arrays import Array
from tracker.pipeline.tracked_changes import number, numbers
from tracker.session.store.records import Alternative, AssessmentChange, PoseChange, PoseRecord


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
