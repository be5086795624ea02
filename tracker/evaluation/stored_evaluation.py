"""Compare the stored poses of a person with a reference.

Notice that an estimate and its reference are not of the same recording, axes, units or origin.

Split joint errors into a constant offset of each joint and the rest.

A model's joint that lies beside the anatomical one does so by the same vector in the body in every frame, not in the
world. The offset is therefore the mean difference in the frame of the proximal part, in which body files state
joint centres too (`BodyModel.proximal_parts`): the pelvis for a hip, the thigh for a knee.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import gcd
from typing import NamedTuple

import numpy as np

from tracker.errors import Remedy, SessionError
from tracker.evaluation.metric import ComparedJoints, metrics
from tracker.evaluation.metrics import (
    LOST_M,
    Alignment,
    Evaluation,
    Motion,
    best_rigid,
    evaluate_joints,
    evaluate_poses,
    gather_joints,
    joint_errors,
)
from tracker.evaluation.references import Reference, stored_motion
from tracker.formats.joint_maps import LIMB_JOINTS, JointMap
from tracker.formats.trc import MarkerTable, axes_matrix
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.interchange.plausibility.readings import Reading, ReadPoints, read_beside
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


APART_M = 1.0
"""Median distance above which two motions are not estimates of one."""


def length_note(n_session: int, n_reference: int | None) -> str | None:
    """Say that a session and its reference differ in length; `n_reference` is None where the length is unknown."""
    if n_reference is None or n_reference == n_session:
        return None
    return (
        f"the session has {n_session} frames and the reference {n_reference}: check that it is of this recording and "
        "begins at the same instant"
    )


def distance_note(
    estimated: MarkerTable, reference: MarkerTable, frames: Sequence[int], axes: str = "x,y,z", up: str = "z"
) -> tuple[str, Remedy] | None:
    """Say that a reference is not of the estimate's frames, or lies metres from it, and what would bring it near.

    Args:
        estimated: joints under the project's names.
        reference: the same.
        frames: the frames to compare.
        axes: the axes as which the reference was read (`axes_matrix`).
        up: world axis that points up.
    """
    names = tuple(j for j in LIMB_JOINTS if j in estimated.names and j in reference.names)
    estimate, truth = (gather_joints(t, names, frames) for t in (estimated, reference))
    both = np.isfinite(estimate + truth).all(axis=-1)
    if not both.any():
        return None
    apart = _median_m(estimate[both], truth[both])
    as_given = Reading(JointMap("the reference", {name: name for name in names}), axes)
    known = {name: estimate[:, i] for i, name in enumerate(names)}
    in_file = truth @ axes_matrix(axes)  # the inverse of a rotation is its transpose
    vertical, is_near = floor_plane(up, None).normal, apart <= APART_M
    read = read_beside(known, in_file, frames, vertical, estimated.rate, ignores_offsets=is_near)
    if is_near:
        return _lag_note(read, as_given)
    why, remedy = _explanation(read, as_given, estimate[both], truth[both])
    return f"the reference lies {apart:.2f} m from the poses (median over the joints){why}", remedy


def _lag_note(read: ReadPoints, own: Reading) -> tuple[str, Remedy] | None:
    lag = read.lag(own)
    if lag is None or not lag.frames:
        return None
    return f"the reference fits the poses of {lag} best", Remedy("check_reference_frames")


def _explanation(read: ReadPoints, own: Reading, estimate: Array, truth: Array) -> tuple[str, Remedy]:
    """Say which change of the reference, (n, 3), brings it within `LOST_M` of the estimate, (n, 3)."""
    best = read.likeliest(own, [own.joint_map], in_space=True)[0]
    distance_m = _median_m(estimate, best.scale * truth @ axes_matrix(own.axes) @ axes_matrix(best.axes).T)
    if distance_m < LOST_M and best.scale == own.scale:
        return "", Remedy("reference_axes", axes=best.axes, distance_m=distance_m)
    if best.scale != own.scale:
        size = f"{1 / best.scale:.4g} times as large" if best.scale < 1 else f"{best.scale:.4g} times smaller"
        return f": it is {size}", Remedy("reference_units")
    if len(truth) >= 3 and _median_m(rigid.apply(best_rigid(truth, estimate), truth), estimate) < LOST_M:
        return ": it is of the same motion in a world with another origin or direction", Remedy("align_reference")
    return "", Remedy("check_reference")


def _median_m(a: Array, b: Array) -> float:
    return float(np.median(np.linalg.norm(a - b, axis=-1)))


def evaluate_offsets(
    result: Evaluation,
    motion: Motion,
    tables: tuple[MarkerTable, MarkerTable],
    frames: Sequence[int],
    align: Alignment = "none",
) -> Evaluation:
    """Add each joint's constant offset, and the errors without the offsets.

    Args:
        result: the errors of the joints.
        motion: the estimated poses.
        tables: estimated and reference joints, as `evaluate_joints` takes them.
        frames: the frames to compare.
        align: as there.
    """
    errors = joint_errors(*tables, frames, align)
    R = errors.R_align @ _rotations(motion, errors.joints, frames)
    local = np.einsum("nmji,nmj->nmi", R, errors.vectors)
    known = np.isfinite(local).all(axis=-1)
    counts = known.sum(axis=0)
    offsets = np.where(known[..., None], local, 0.0).sum(axis=0) / np.maximum(counts, 1)[:, None]
    rest = np.linalg.norm(local - offsets, axis=-1)
    has = [(i, joint) for i, joint in enumerate(errors.joints) if counts[i]]
    limbs = rest[:, errors.is_limb]
    limbs = limbs[np.isfinite(limbs)]
    return replace(
        result,
        offsets_mm={joint: tuple((1000 * offsets[i]).tolist()) for i, joint in has},
        mpjpe_without_offsets_mm=1000 * float(limbs.mean()) if len(limbs) else None,
        per_joint_without_offsets_mm={joint: 1000 * float(rest[known[:, i], i].mean()) for i, joint in has},
    )


def _rotations(motion: Motion, joints: Sequence[str], frames: Sequence[int]) -> Array:
    """Return the rotation of each joint's proximal part in each frame, (n, m, 3, 3); NaN without a pose."""
    model = motion.model
    parts = model.proximal_parts[[model.point_names.index(j) for j in joints]]
    out = np.full((len(frames), len(joints), 3, 3), np.nan)
    for i, frame in enumerate(frames):
        if frame in motion.poses:
            out[i] = model.kinematics(motion.poses[frame]).Ts_world_part[parts, :3, :3]
    return out
