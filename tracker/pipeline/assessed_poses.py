"""Give a pose its status and the reason for it: by the whole run, or by the features of its limbs on their frame."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.geometry.arrays import Array
from tracker.store.records import PoseRecord
from tracker.tracking.confidence import Status, classify_limbs, probabilities, status_named, worst
from tracker.tracking.pose_errors import elsewhere_odds, limb_odds, mass_odds, point_covariances
from tracker.tracking.remarks import may_be_elsewhere, uncertain, without_uncertainty
from tracker.tracking.run_confidence import log_odds
from tracker.tracking.runs.path_assessment import RunPose


def assessed_by_features(model: BodyModel, pose: PoseRecord, features: Array, is_ambiguous: bool) -> PoseRecord:
    """Return a pose with the status that follows from the features of its limbs.

    Args:
        model: the body.
        pose: the pose.
        features: see `run_confidence.run_features`, (n_limbs, 8).
        is_ambiguous: whether other poses are about as good.
    """
    found = _classified(model, pose, log_odds(features), [""] * len(features))
    least: Status = "doubtful" if is_ambiguous else "good"
    return replace(found, status=worst([status_named(found.status), least]))


def assessed_by_run(model: BodyModel, pose: PoseRecord, found: RunPose) -> PoseRecord:
    """Return a pose with the errors of its points, and the status that follows from them and from what else it may be.

    Args:
        model: the body.
        pose: the pose.
        found: what all frames of the run say about it.
    """
    errors = point_covariances(model, found.errors_m2)
    searched = [found.is_searched and len(limb.parts) > 1 for limb in limbs(model)]
    odds = np.stack([limb_odds(model, errors), mass_odds(found.elsewhere), elsewhere_odds(found.by_colors, searched)])
    reasons = [""] * len(searched)
    for i, source in enumerate(odds[:, :, 0].argmax(axis=0)):
        if source == 1 and not found.others:  # else the remark on them says so
            reasons[i] = f": elsewhere on {100 * found.elsewhere[i]:.0f}% of the likely paths"
        elif source == 2:
            reasons[i] = f": {found.against[i]}"
    remarks = without_uncertainty(pose.remark, alternatives=True)
    if found.others:
        remarks.append(may_be_elsewhere(PosedBody(model, pose.values), found.others))
    pose = replace(pose, errors=errors, remark=", ".join(remarks))
    return _classified(model, pose, odds.max(axis=0), reasons)


def _classified(model: BodyModel, pose: PoseRecord, odds: Array, reasons: Sequence[str]) -> PoseRecord:
    """Return a pose with the status that follows from the log odds that its limbs are off and lost, (n_limbs, 2)."""
    status = classify_limbs(odds)
    remarks, worst_limb = without_uncertainty(pose.remark), int(odds[:, 1].argmax())
    if status != "good" and (reasons[worst_limb] or not remarks):
        remarks = [uncertain(limbs(model)[worst_limb].name, reasons[worst_limb]), *remarks]
    lost = tuple(map(float, probabilities(odds[:, 1])))
    return replace(pose, status=status, limbs_lost=lost, remark=", ".join(remarks))
