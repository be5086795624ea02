"""Errors of an estimated motion against a reference: of joints, and of angles if the reference has poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import BENT_RAD
from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import shortest_step
from tracker.errors import FormatError, Remedy
from tracker.formats.joint_maps import JOINTS, LIMB_JOINTS
from tracker.formats.trc import MarkerTable
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

LOST_M = 0.15
"""A frame with a limb joint off by more is lost, metres."""

Alignment = Literal["none", "rigid-all"]


@dataclass(frozen=True)
class Evaluation:
    """The errors of an estimated motion against its reference."""

    frames: int
    """Number of frames compared."""
    missing_frames: int
    """Number of frames without an estimate."""
    missing_reference_values: int
    """Number of positions of limb joints that the reference lacks in these frames; skipped."""
    lost_frames: int
    """Number of frames without an estimate, or with a limb joint off by more than 150 mm."""
    lost_frame_numbers: tuple[int, ...]
    """These frames, ascending."""
    mpjpe_mm: float
    """Mean distance over frames and limb joints."""
    pa_mpjpe_mm: float | None
    """The same after the best rotation and translation of each frame (no scale); None if no frame has 3 joints."""
    median_mm: float
    """Median distance over frames and limb joints."""
    p95_mm: float
    """95th percentile of the distance over frames and limb joints."""
    per_joint_mm: Mapping[str, float]
    """Mean distance of each joint that both have, including head and neck."""
    fps: float
    """Frames per second of those compared, 1/s; the acceleration error depends on it."""
    acceleration_error_m_s2: float | None
    """Mean norm of the second difference of the error over frames and limb joints, m/s^2, as the human-mesh literature
    has it (A. Kanazawa et al. 2019); None without three frames in a row."""
    per_frame: tuple["FrameAccuracy", ...]
    """The error of each frame."""
    offsets_mm: Mapping[str, tuple[float, ...]] | None = None
    """Mean difference of each joint from the reference in the frame of its proximal part, (3,); None without poses
    of the estimate. See `stored_evaluation`."""
    mpjpe_without_offsets_mm: float | None = None
    """`mpjpe_mm` after each joint's offset is taken away."""
    per_joint_without_offsets_mm: Mapping[str, float] | None = None
    """`per_joint_mm` after each joint's offset is taken away."""
    axis_error_deg: float | None = None
    """Mean angle between true and estimated part axes, over frames and parts. It includes the twist where the truth
    determines it. None without true poses."""
    long_axis_error_deg: float | None = None
    """The same without twist: the parts' long axes alone, as KRH08 measured; None without true poses."""
    worst_axis_error_deg: float | None = None
    """The largest mean over the parts of one frame; None without true poses."""
    worst_axis_frame: int | None = None
    """The frame with this mean; None without true poses."""
    per_part_axis_deg: Mapping[str, float] | None = None
    """Mean angle of each part that both bodies have, over the frames; None without true poses."""
    angle_error_deg: Mapping[str, float] | None = None
    """Mean absolute error of each angle by degree of freedom; None without true poses of the same model."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    """Measures that other packages add (`tracker.evaluation.metric`), by name."""


class FrameAccuracy(NamedTuple):
    """The error of one frame."""

    frame: int
    status: str | None
    """Status that the tracker gave the pose, `keyframe` for one that a person set; None without a pose or status."""
    mean_mm: float | None
    """Mean distance over the limb joints; None where there is none to compare."""
    worst_mm: float | None
    """Largest distance of a limb joint."""
    worst_joint: str | None
    """The joint with this distance."""
    probability_off: float | None = None
    """Probability that a limb is off, the largest of all limbs; None where it was not assessed."""
    reason: str = ""
    """The tracker's reason against the pose; empty where there is none."""
    seam_mm: float | None = None
    """How far the passes from the two keyframes around the frame lie apart; None elsewhere."""


class PoseDoubt(NamedTuple):
    """Status of a stored pose, and the tracker's reason for it."""

    status: str
    """`keyframe` for a pose that a person set; empty where it was not assessed."""
    probability_off: float | None = None
    """See `FrameAccuracy`."""
    reason: str = ""
    """See `FrameAccuracy`."""
    seam_mm: float | None = None
    """See `FrameAccuracy`."""


class JointErrors(NamedTuple):
    """Joints of an estimate and a reference compared."""

    joints: tuple[str, ...]
    """The joints that both have."""
    is_limb: NDArray[np.bool_]
    """Whether each is one of `LIMB_JOINTS`, (m,)."""
    estimate: Array
    """Estimated positions after the alignment, (n, m, 3), metres; NaN where missing."""
    truth: Array
    """Reference positions, likewise."""
    R_align: Array
    """Rotation by which the estimate was aligned, (3, 3)."""

    @property
    def vectors(self) -> Array:
        """Estimate less reference, (n, m, 3), metres."""
        return self.estimate - self.truth


class Motion(NamedTuple):
    """Poses of one body over time."""

    model: BodyModel
    """The body of all of them."""
    poses: Mapping[int, Array]
    """Values by frame, (n_values,) each."""


def evaluate_joints(
    estimated: MarkerTable,
    reference: MarkerTable,
    frames: Sequence[int],
    align: Alignment = "none",
    assessed: Mapping[int, PoseDoubt] | None = None,
) -> Evaluation:
    """Compare joints frame by frame. Both tables have the project's names (`joint_maps.joints_of`) and frame numbers.

    Args:
        estimated: the estimate; a frame may be missing.
        reference: the truth; a frame or a position may be missing.
        frames: the frames to compare.
        align: `rigid-all` first moves the estimate as a whole by the best rotation and translation over all frames.
        assessed: the estimated poses by frame, for `Evaluation.per_frame`.

    Raises:
        FormatError: there is nothing to compare.
    """
    found = joint_errors(estimated, reference, frames, align)
    joints, is_limb, estimate, truth = found.joints, found.is_limb, found.estimate, found.truth
    both: NDArray[np.bool_] = np.all(np.isfinite(found.vectors), axis=-1)  # (n, m)
    error = np.linalg.norm(found.vectors, axis=-1)  # (n, m), NaN where not comparable
    limb_error = error[:, is_limb]
    missing = np.isin(frames, estimated.frames, invert=True)
    lost = missing | (np.nan_to_num(limb_error) > LOST_M).any(axis=1)
    aligned = np.concatenate(
        [_procrustes_error(e[b], t[b]) for e, t, b in zip(estimate, truth, both & is_limb, strict=True)]
    )
    limb_mm = limb_error[np.isfinite(limb_error)] * 1000
    fps = estimated.rate / (frames[1] - frames[0] if len(frames) > 1 else 1)
    limb_joints = [j for j, of_limb in zip(joints, is_limb, strict=True) if of_limb]
    return Evaluation(
        frames=len(frames),
        missing_frames=int(missing.sum()),
        missing_reference_values=int(np.isnan(truth[:, is_limb]).any(axis=-1).sum()),
        lost_frames=int(lost.sum()),
        lost_frame_numbers=tuple(frame for frame, is_lost in zip(frames, lost.tolist(), strict=True) if is_lost),
        mpjpe_mm=float(limb_mm.mean()),
        pa_mpjpe_mm=float(aligned.mean()) * 1000 if len(aligned) else None,
        median_mm=float(np.median(limb_mm)),
        p95_mm=float(np.percentile(limb_mm, 95)),
        per_joint_mm={j: float(np.nanmean(error[:, i])) * 1000 for i, j in enumerate(joints) if both[:, i].any()},
        fps=fps,
        acceleration_error_m_s2=_acceleration_error(found.vectors[:, is_limb], fps),
        per_frame=tuple(
            _frame_error(frame, limb_joints, 1000 * errors, (assessed or {}).get(frame, PoseDoubt("")))
            for frame, errors in zip(frames, limb_error, strict=True)
        ),
    )


def joint_errors(
    estimated: MarkerTable, reference: MarkerTable, frames: Sequence[int], align: Alignment = "none"
) -> JointErrors:
    """Collect the joints that both tables have; see `evaluate_joints`.

    Raises:
        FormatError: there is nothing to compare.
    """
    joints = tuple(j for j in JOINTS if j in estimated.names and j in reference.names)
    estimate, truth = (
        gather_joints(estimated, joints, frames),
        gather_joints(reference, joints, frames),
    )  # (n, m, 3), NaN: none
    is_limb = np.array([j in LIMB_JOINTS for j in joints], dtype=bool)
    both: NDArray[np.bool_] = np.all(np.isfinite(estimate) & np.isfinite(truth), axis=-1)  # (n, m)
    if not both[:, is_limb].any():
        raise FormatError(
            "the estimate and the reference have no limb joint of the same frame in common",
            Remedy("check_reference_frames"),
        )
    R_align = np.eye(3)
    if align == "rigid-all":
        used = both & is_limb
        T = best_rigid(estimate[used], truth[used])
        estimate, R_align = rigid.apply(T, estimate), T[:3, :3]
    return JointErrors(joints, is_limb, estimate, truth, R_align)


def _acceleration_error(vectors: Array, fps: float) -> float | None:
    """Return the mean norm of the second difference of errors, (n, m, 3), over the square of the frame time, m/s^2."""
    if len(vectors) < 3:
        return None
    norms = np.linalg.norm(np.diff(vectors, n=2, axis=0), axis=-1)
    norms = norms[np.isfinite(norms)]
    return float(norms.mean()) * fps**2 if len(norms) else None


def _frame_error(frame: int, joints: Sequence[str], errors_mm: Array, assessed: PoseDoubt) -> FrameAccuracy:
    status = assessed.status
    known = assessed.probability_off, assessed.reason, assessed.seam_mm
    if not np.isfinite(errors_mm).any():
        return FrameAccuracy(frame, status or None, None, None, None, *known)
    worst = int(np.nanargmax(errors_mm))
    mean = float(np.nanmean(errors_mm))
    return FrameAccuracy(frame, status or None, mean, float(errors_mm[worst]), joints[worst], *known)


def evaluate_poses(result: Evaluation, estimated: Motion, true: Motion, frames: Sequence[int]) -> Evaluation:
    """Compare the parts of two bodies by name, over the frames that both have; their models and dimensions may differ.

    A part's error is the angle between its true and estimated long axis (z). For the parts next to an elbow or knee
    that is bent by more than 20 degrees in the truth, it is the angle of the whole rotation, including the twist. The
    same holds for the root and the parts rigidly attached to it. Bodies with the same degrees of freedom are compared
    angle by angle too.

    Args:
        result: the errors of the joints; the angles are added.
        estimated: the estimate.
        true: the truth.
        frames: the frames to compare.

    Raises:
        FormatError: there is no frame or no part in common.
    """
    common = [f for f in frames if f in estimated.poses and f in true.poses]
    if not common:
        raise FormatError("the estimate and the reference have no frame in common", Remedy("check_reference_frames"))
    parts = [p.name for p in true.model.parts if p.name in estimated.model.part_index]
    if not parts:
        raise FormatError(
            f"the bodies '{estimated.model.name}' and '{true.model.name}' have no part of the same name; "
            "compare joints instead, with a TRC file"
        )
    long_axis, errors = np.degrees([_part_errors(estimated, true, parts, f) for f in common]).swapaxes(0, 1)  # (n, m)
    of_frames = errors.mean(axis=1)
    worst = int(np.argmax(of_frames))
    same = true.model.dof_names == estimated.model.dof_names
    return replace(
        result,
        axis_error_deg=float(errors.mean()),
        long_axis_error_deg=float(long_axis.mean()),
        worst_axis_error_deg=float(of_frames[worst]),
        worst_axis_frame=common[worst],
        per_part_axis_deg=dict(zip(parts, errors.mean(axis=0).tolist(), strict=True)),
        angle_error_deg=_dof_errors(estimated, true, common) if same else None,
    )


def joints_of_poses(model: BodyModel, poses: Mapping[int, Array], rate: float) -> MarkerTable:
    """Return the joint centres of a person's poses under the project's names, one row per frame.

    Args:
        model: body model of all poses.
        poses: values by frame, each (n_values,).
        rate: frames per second.
    """
    names = tuple(j for j in JOINTS if j in model.point_names)
    columns = [model.point_names.index(n) for n in names]
    frames = np.array(sorted(poses), dtype=np.int64)
    points = [model.joint_centers_world(poses[f])[columns] for f in frames.tolist()]
    return MarkerTable(names, frames, frames / rate, np.array(points).reshape(-1, len(names), 3), rate)


def best_rigid(source: Array, target: Array) -> Array:
    """Return the rigid motion, (4, 4), that aligns points (n, 3) best with others (Kabsch 1976, no scale)."""
    center_source, center_target = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((target - center_target).T @ (source - center_source))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return rigid.transform(R, center_target - R @ center_source)


def gather_joints(table: MarkerTable, joints: Sequence[str], frames: Sequence[int]) -> Array:
    """Collect the positions of joints in frames, (n_frames, n_joints, 3); NaN where missing."""
    out = np.full((len(frames), len(joints), 3), np.nan)
    rows: NDArray[np.int64] = np.searchsorted(table.frames, frames)
    there = np.isin(frames, table.frames)
    columns = [table.names.index(j) for j in joints]
    out[there] = table.points[rows[there]][:, columns]
    return out


def _procrustes_error(estimate: Array, truth: Array) -> Array:
    """Return distances (k,) after the best rigid motion; empty for fewer than 3 points, which fix no rotation."""
    if len(estimate) < 3:
        return np.zeros(0)
    return np.linalg.norm(rigid.apply(best_rigid(estimate, truth), estimate) - truth, axis=-1)


def _part_errors(estimated: Motion, true: Motion, parts: Sequence[str], frame: int) -> Array:
    """Return the angular error of each named part on a frame, without and with twist, (2, n_parts), rad."""
    R_estimated, R_true = (m.model.kinematics(m.poses[frame]).Ts_world_part[:, :3, :3] for m in (estimated, true))
    shows = _shows_twist(true.model, R_true)
    in_estimated, in_true = ([m.model.part_index[p] for p in parts] for m in (estimated, true))
    R_estimated, R_true = R_estimated[in_estimated], R_true[in_true]
    axis = _angle(R_estimated[:, :, 2], R_true[:, :, 2])
    whole = np.linalg.norm(rigid.so3_log(np.swapaxes(R_true, 1, 2) @ R_estimated), axis=-1)
    return np.stack([axis, np.where(shows[in_true], whole, axis)])


def _dof_errors(estimated: Motion, true: Motion, frames: Sequence[int]) -> dict[str, float]:
    """Return the mean absolute error of each angle by degree of freedom, the shorter way round, degrees."""
    model = true.model
    steps = np.array([shortest_step(model, estimated.poses[f], true.poses[f]) for f in frames])
    mean = np.degrees(np.abs(np.arctan2(np.sin(steps), np.cos(steps))).mean(axis=0))
    return {n: float(mean[i]) for i, n in enumerate(model.dof_names) if not model.dof_is_length[i]}


def _shows_twist(model: BodyModel, R_world_part: Array) -> NDArray[np.bool_]:
    """Return whether a pose determines how each part is rotated about its long axis, (n_parts,)."""
    shows = np.zeros(len(model.parts), dtype=bool)
    for part, (joint, parent) in enumerate(zip(model.joints, model.parents, strict=True)):
        if parent < 0 or (shows[parent] and not joint.dof_names):
            shows[part] = True
        elif joint.name.endswith(("elbow", "knee")):
            bent = _angle(R_world_part[part, :, 2], R_world_part[parent, :, 2]) > BENT_RAD
            shows[[part, parent]] = bent
    return shows


def _angle(a: Array, b: Array) -> Array:
    """Return the angle between unit vectors, (..., 3) to (...), rad; accurate for small angles."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
