"""Give a pose its status and the reason for it, by the features of its limbs or by tracks without a view each."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.fitting.consensus import Consensus, agreement
from tracker.geometry.arrays import Array
from tracker.pipeline.run_repair import RepairedPose
from tracker.store.records import Alternative, AssessmentChange, PoseChange, PoseRecord
from tracker.tracking.confidence import classify_limbs, probabilities, worst
from tracker.tracking.estimation.limb_repair import MIN_GAIN_NATS
from tracker.tracking.pose_errors import alternative_odds, elsewhere_odds, limb_odds, point_covariances
from tracker.tracking.remarks import may_be_elsewhere, uncertain, without_uncertainty
from tracker.tracking.run_confidence import log_odds
from tracker.tracking.view_tracks import FrameTracks


def assessed_by_features(model: BodyModel, pose: PoseRecord, features: Array, is_ambiguous: bool) -> PoseRecord:
    """Return a pose with the status that follows from the features of its limbs.

    Args:
        model: the body.
        pose: the pose.
        features: see `run_confidence.run_features`, (n_limbs, 8).
        is_ambiguous: whether other poses are about as good.
    """
    return _classified(model, pose, log_odds(features), [""] * len(features), is_ambiguous)


def assessed_by_tracks(
    model: BodyModel, pose: PoseRecord, found: Consensus, tracks: FrameTracks, is_ambiguous: bool,
    features: Array | None = None, repaired: RepairedPose | None = None,
) -> PoseRecord:  # fmt: skip
    """Return a pose with the errors of its points, and the status that follows from them.

    Near the start, tracks have had no time to come apart. There, the features of its limbs count where the colours of
    the run are not known.

    Args:
        model: the body.
        pose: the pose.
        found: how far the tracks lie from it.
        tracks: the tracks.
        is_ambiguous: whether other poses are about as good, by the tracker.
        features: of its limbs, as above; None where they are not known.
        repaired: how well it agrees with the colours of the run, and other poses by contours and colours together,
            which take the place of those of the tracker; None where that is not known.
    """
    errors = point_covariances(model, found.covariances)
    # For each limb the view without which it is farthest away.
    of_limbs = [found.distances_m[:, np.isin(model.point_parts, x.parts)].max(axis=1) for x in limbs(model)]
    reasons = [f" without {tracks.without[int(distances.argmax())]}" for distances in of_limbs]
    odds = limb_odds(model, errors)
    if repaired is not None:
        is_ambiguous, odds = False, _with_run(model, pose, repaired, odds, reasons)
    elif features is not None and not tracks.has_history:
        odds = np.maximum(odds, log_odds(features))
    return _classified(model, replace(pose, errors=errors), odds, reasons, is_ambiguous)


def _with_run(model: BodyModel, pose: PoseRecord, repaired: RepairedPose, odds: Array, reasons: list[str]) -> Array:
    """Return the log odds by the colours of the run and by other poses, too, (n_limbs, 2); put in their reasons."""
    by_colors = elsewhere_odds(repaired.elsewhere, [x.name in repaired.searched for x in limbs(model)])
    for i in np.flatnonzero(by_colors[:, 0] > odds[:, 0]):
        reasons[i] = f": {repaired.against[i]}"
    odds = np.maximum(odds, by_colors)
    by_others = alternative_odds(model, pose.values, repaired.alternatives)
    for i in np.flatnonzero(by_others[:, 0] > odds[:, 0]):
        reasons[i] = ""  # the remark of `with_repair` says so
    return np.maximum(odds, by_others)


def with_repair(model: BodyModel, pose: PoseRecord, repaired: RepairedPose) -> PoseRecord:
    """Return a pose with the searches of the repair in place of those of an earlier one, and with its alternatives in
    the remark in place of the tracker's."""
    if repaired.trace:
        pose = replace(pose, trace=(*(x for x in pose.trace or () if x.kind != "repair"), *repaired.trace))
    remarks = without_uncertainty(pose.remark, alternatives=True)
    if repaired.alternatives:
        remarks.append(may_be_elsewhere(PosedBody(model, repaired.pose), repaired.alternatives))
    return replace(pose, remark=", ".join(remarks))


def with_alternatives(change: PoseChange, repaired: RepairedPose) -> PoseChange:
    """Return a row with the alternatives of its repair in place of those of the tracker."""
    if change.pose is None:
        return change
    revision = change.pose.model_revision
    return replace(change, alternatives=tuple(Alternative(h.pose, revision) for h in repaired.alternatives))


def assessed_keyframe(
    model: BodyModel, person: str, frame: int, keyframe: PoseRecord, tracks: FrameTracks,
    repaired: RepairedPose | None = None,
) -> AssessmentChange | None:  # fmt: skip
    """Return what is known about a keyframe, by the same evidence as of other poses.

    A person has seen more than a track has, and has chosen among poses that are about as good. If the repair has
    examined the keyframe, tracks therefore only propose. It is doubtful where its contours pull it away, the colours of
    the run find a limb elsewhere, or another pose is clearly better.

    Args:
        model: the body.
        person: name.
        frame: its number.
        keyframe: the pose.
        tracks: without a view each, which have not seen it.
        repaired: how well it agrees with the colours of the run; None where that is not known.

    Returns:
        None where only tracks that went out from the keyframe are known: they agree with it in any case.
    """
    if repaired is None and not tracks.has_history:
        return None
    trust = tracks.trust if repaired is None else tracks.trust * repaired.trust
    found = agreement(model, keyframe.values, tracks.poses, trust)
    plain = replace(keyframe, remark="")
    if repaired is None or repaired.refined is None:
        pose = assessed_by_tracks(model, plain, found, tracks, False, None, repaired)
    else:
        plain = replace(plain, errors=point_covariances(model, found.covariances))
        pose = _assessed_by_its_frame(model, plain, repaired, repaired.refined)
    return AssessmentChange.of(person, frame, pose)


def _assessed_by_its_frame(
    model: BodyModel, keyframe: PoseRecord, repaired: RepairedPose, refined: Array
) -> PoseRecord:
    """Return a keyframe with the status by how far its contours pull it, (n_values,), and by clearly better poses."""
    better = tuple(h for h in repaired.alternatives if h.cost < -MIN_GAIN_NATS)
    repaired = repaired._replace(alternatives=better)
    pulled = agreement(model, keyframe.values, refined[None], np.ones((1, len(limbs(model)))))
    odds = limb_odds(model, point_covariances(model, pulled.covariances))
    reasons = [": contours elsewhere"] * len(odds)
    odds = _with_run(model, keyframe, repaired, odds, reasons)
    return _classified(model, with_repair(model, keyframe, repaired), odds, reasons, False)


def _classified(
    model: BodyModel, pose: PoseRecord, odds: Array, reasons: Sequence[str], is_ambiguous: bool
) -> PoseRecord:
    """Return a pose with the status that follows from the log odds that its limbs are off and lost, (n_limbs, 2)."""
    status = classify_limbs(odds)
    if is_ambiguous:
        status = worst([status, "doubtful"])
    remarks, worst_limb = without_uncertainty(pose.remark), int(odds[:, 1].argmax())
    if status != "good" and (reasons[worst_limb] or not remarks):
        remarks = [uncertain(limbs(model)[worst_limb].name, reasons[worst_limb]), *remarks]
    lost = tuple(map(float, probabilities(odds[:, 1])))
    return replace(pose, status=status, limbs_lost=lost, remark=", ".join(remarks))
