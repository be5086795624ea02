"""The expected error of stored poses, by their covariances and the odds that a limb is lost.

The error of a joint is normal with its stored covariance, or at least that of a lost limb with the probability that the
limb is lost. Errors persist: a limb that is off on one frame is off on the next, too. The persistence is measured in
the recording, as the correlation of the logarithms of expected errors of neighbouring frames.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.estimation.tracking.pose_errors import LOST_FROM, point_covariances
from tracker.evaluation.metrics import LOST_M
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.stored_poses import StoredPose

TRUNK = "trunk"
"""Name of the unit of the joints that belong to no limb: shoulders and hips."""


@dataclass(frozen=True, eq=False)
class ExpectedErrors:
    """The limb joints of one person on the frames that have a pose, in the order of time, and their errors."""

    frames: IntArray
    """Their numbers, (T,)."""
    points_world: Array
    """Places of the joints, (T, J, 3), metres."""
    covariances: Array
    """Of these places, (T, J, 3, 3), m^2."""
    lost: Array
    """Probability that the limb of each joint is lost, (T, J)."""
    keyframes: NDArray[np.bool_]
    """Whether a person set or verified the pose, (T,)."""
    units: tuple[str, ...]
    """Limbs with joints, and the trunk, for display."""
    unit_of: IntArray
    """Index of the unit of each joint, (J,)."""
    joints: tuple[str, ...]
    """Names of the joints, (J,)."""
    shared: Array
    """Variance along an axis of the error that all frames share, (J,), m^2."""

    @cached_property
    def variances(self) -> Array:
        """Mean variance along an axis, (T, J), m^2."""
        return np.trace(self.covariances, axis1=2, axis2=3) / 3

    @cached_property
    def errors_m(self) -> Array:
        """Expected error of each joint, (T, J), metres."""
        return mean_errors(self.variances, self.lost)

    @property
    def is_lost(self) -> NDArray[np.bool_]:
        """Whether a limb is called lost on a frame, (T,)."""
        return np.asarray((self.lost > LOST_FROM).any(axis=1))

    @cached_property
    def persistence(self) -> float:
        """Correlation of the errors of neighbouring frames, from 0 to below 1.

        That of the logarithm of the expected error, about its mean over time, pooled over the joints. Keyframes do not
        count.
        """
        steps = np.diff(self.frames) == 1
        pairs = steps & ~self.keyframes[1:] & ~self.keyframes[:-1]
        logs = np.log(np.maximum(self.errors_m, np.sqrt(self.shared)))
        logs = logs - logs[~self.keyframes].mean(axis=0) if not self.keyframes.all() else logs * 0
        before, after = logs[:-1][pairs], logs[1:][pairs]
        scale = np.sqrt(np.sum(before**2) * np.sum(after**2))
        n = max(2, len(self.frames))
        return float(np.clip(np.sum(before * after) / scale, 0.0, 1 - 1 / n)) if scale > TINY else 0.0

    @property
    def mean_variance(self) -> float:
        """Variance of the mean error over all joints and frames, m^2.

        Errors of the joints of a unit are the same, those of units independent. What all views share is constant.
        """
        n_frames, n_joints = self.variances.shape
        of_length = 3 - 8 / np.pi  # variance of the length of a normal vector, in variances along an axis
        spread = np.sqrt(of_length * self.variances + self.lost * (1 - self.lost) * LOST_M**2)
        of_units = [spread[:, self.unit_of == u].sum(axis=1) for u in range(len(self.units))]
        r = self.persistence
        longer = min(float(n_frames), (1 + r) / (1 - r))
        shared = of_length * self.shared.mean() / n_joints
        return float(longer * np.sum(np.square(of_units)) / (n_frames * n_joints) ** 2 + shared)


def mean_errors(variances: Array, lost: Array | float) -> Array:
    """Return the expected length of errors, metres.

    That of a normal vector in three dimensions is sqrt(8 / pi) sigma (Maxwell distribution).

    Args:
        variances: along an axis where the limb is not lost, of any shape, m^2.
        lost: probability that it is lost, likewise.
    """
    known = np.sqrt(8 / np.pi * variances)
    return np.asarray((1 - lost) * known + lost * np.maximum(known, LOST_M))


def expected_errors(
    model: BodyModel, poses: Mapping[int, StoredPose], contradicted: Collection[int] = ()
) -> ExpectedErrors:
    """Return the expected errors of the stored poses of a person.

    A pose without errors has the median covariances of those that have some, or those that all views share. No limb of
    a keyframe is lost, unless it was contradicted.

    Args:
        model: the present body of the person.
        poses: by frame, at least one; those of another skeleton are left out.
        contradicted: see `contradicted_keyframes`.
    """
    alike = {k: p for k, p in sorted(poses.items()) if p.body.model.point_names == model.point_names}
    joints, names, unit_of, limb_of = correctable_joints(model)
    columns = [model.point_names.index(n) for n in joints]
    assessed = [p.record.errors[columns] for p in alike.values() if p.record.errors is not None]
    shared = point_covariances(model)[columns]
    usual = np.median(assessed, axis=0) if assessed else shared
    covariances, lost = np.empty((len(alike), len(columns), 3, 3)), np.zeros((len(alike), len(columns)))
    for t, (frame, pose) in enumerate(alike.items()):
        record = pose.record
        covariances[t] = usual if record.errors is None else record.errors[columns]
        if record.limbs_lost and (not record.keyframe or frame in contradicted):
            of_limbs = np.append(record.limbs_lost, 0.0)  # the last one is the trunk's
            lost[t] = of_limbs[limb_of]
    return ExpectedErrors(
        np.array([*alike], dtype=np.int64),
        np.array([p.body.joint_centers_world[columns] for p in alike.values()]).reshape(-1, len(columns), 3),
        covariances,
        lost,
        np.array([p.record.keyframe for p in alike.values()], dtype=bool),
        names,
        unit_of,
        joints,
        shared[:, 0, 0],
    )


def contradicted_keyframes(store: AnnotationStore, person: str) -> frozenset[int]:
    """Return the keyframes of a person that were assessed as doubtful or lost after they were set or verified."""
    rows = store.frames(person)
    return frozenset(r.frame for r in rows if r.keyframe and r.assessed_since and r.status in ("doubtful", "lost"))


class CorrectableJoints(NamedTuple):
    """The limb joints of a body, and what each is corrected with."""

    joints: tuple[str, ...]
    """Names of the joints, (J,); all points of a body that has no limb joints."""
    units: tuple[str, ...]
    """The trunk if a joint belongs to no limb, and limbs with joints, for display."""
    unit_of: IntArray
    """Index of the unit of each joint, (J,)."""
    limb_of: IntArray
    """Index of the limb of each joint in `tracker.body.limbs.limbs`, (J,); -1 for the trunk."""


def correctable_joints(model: BodyModel) -> CorrectableJoints:
    """Return the limb joints of a body by the limb that carries them; a hip on the trunk belongs to the trunk."""
    joints = tuple(n for n in model.point_names if n in LIMB_JOINTS) or model.point_names
    parts, all_limbs = model.proximal_parts[[model.point_names.index(n) for n in joints]], limbs(model)
    limb_of = np.array([next((i for i, x in enumerate(all_limbs) if part in x.parts), -1) for part in parts])
    used = sorted({*limb_of.tolist()})
    names = tuple(TRUNK if i < 0 else limb_display_name(all_limbs[i].name) for i in used)
    return CorrectableJoints(joints, names, np.array([used.index(i) for i in limb_of]), limb_of)
