"""Split joint errors into a constant offset of each joint and the rest.

A model's joint that lies beside the anatomical one does so by the same vector in the body in every frame, not in the
world. The offset is therefore the mean difference in the frame of the proximal part, in which body files state
joint centres too (`BodyModel.proximal_parts`): the pelvis for a hip, the thigh for a knee.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.evaluation.metrics import Alignment, Evaluation, Motion, joint_errors
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array


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
