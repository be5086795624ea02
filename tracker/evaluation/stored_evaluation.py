"""Compare the stored poses of a person with a reference."""

from collections.abc import Sequence
from dataclasses import replace
from math import gcd
from typing import NamedTuple

import numpy as np

from tracker.errors import Remedy, SessionError
from tracker.evaluation.comparability import distance_note, length_note
from tracker.evaluation.joint_offsets import evaluate_offsets
from tracker.evaluation.metric import ComparedJoints, metrics
from tracker.evaluation.metrics import Alignment, Evaluation, evaluate_joints, evaluate_poses, joint_errors
from tracker.evaluation.references import Reference, stored_motion
from tracker.session.session import Session


class StoredEvaluation(NamedTuple):
    """The errors of stored poses, and sentences on whether they can be compared."""

    result: Evaluation
    notes: tuple[str, ...]
    """Sentences on the reference, such as another length."""
    apart: tuple[str, Remedy] | None
    """Sentence and remedy where the two lie metres apart; None elsewhere."""


def evaluate_stored(
    session: Session,
    person: int,
    reference: Reference,
    frames: Sequence[int] | None = None,
    stride: int | None = None,
    align: Alignment = "none",
    axes: str = "x,y,z",
) -> StoredEvaluation:
    """Compare the stored poses of one person with a reference.

    Args:
        session: the session.
        person: index of the person.
        reference: in the session's frames and axes.
        frames: to compare; from the first to the last stored pose by default.
        stride: distance of the frames compared. By default that of the stored poses, so that frames skipped by a run do
            not count as missing.
        align: whether the whole reference is moved onto the estimate first.
        axes: of the reference's file, for the note on its distance.

    Raises:
        SessionError: the person has no pose.
    """
    name, stored = session.people[person].name, stored_motion(session, person)
    joints, motion = stored.joints, stored.motion
    if motion is None or not motion.poses:
        raise SessionError(f"'{name}' has no poses yet; place the body in the page, or use init and track")
    poses = motion.poses
    wanted = range(min(poses), max(poses) + 1) if frames is None else frames
    wanted = wanted[:: stride or gcd(*np.diff(sorted(poses)).tolist()) or 1]
    result = evaluate_joints(joints, reference.joints, wanted, align, stored.assessed)
    result = evaluate_offsets(result, motion, (joints, reference.joints), wanted, align)
    if reference.motion is not None:
        result = evaluate_poses(result, motion, reference.motion, wanted)
    if own := metrics():
        both = joint_errors(joints, reference.joints, wanted, align)
        seen = ComparedJoints(both.joints, tuple(wanted), session.fps, both.estimate, both.truth)
        result = replace(result, metrics={each.name: float(each.compute(seen)) for each in own.values()})
    notes = [*reference.joints.notes]
    if (note := length_note(session.n_frames, reference.n_frames)) is not None:
        notes.append(note)
    apart = distance_note(joints, reference.joints, wanted, axes) if align == "none" else None
    return StoredEvaluation(result, tuple(notes), apart)
