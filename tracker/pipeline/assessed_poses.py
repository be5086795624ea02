"""Give a pose its status, and the reason for it, by the whole run."""

from dataclasses import replace

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
from tracker.pipeline.tracked_changes import number
from tracker.session.store.records import PoseRecord


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
