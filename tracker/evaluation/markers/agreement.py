"""Agreement of stored poses with markers as figures of Bland and Altman: joints, and the angles at knees and elbows."""

from collections.abc import Sequence

import numpy as np

from tracker.evaluation.agreement.comparison import Agreement, compare
from tracker.evaluation.agreement.copies import Copies, Subject
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.interchange.plausibility.body_likelihood import PRIORS

NAMES = ("markers", "video")
_ANGLES = {
    f"{side}_{joint}": tuple(f"{side}_{name}" for name in (above, joint, below))
    for side in ("left", "right")
    for joint, above, below in (("knee", "hip", "ankle"), ("elbow", "shoulder", "wrist"))
}
"""Angles between two bones: 0 where they are one line."""


def compare_with_markers(
    estimate: MarkerTable, markers: MarkerTable, person: str, frames: Sequence[int]
) -> tuple[Copies, Agreement]:
    """Compare joints at the same frames and in the same axes.

    Intervals of agreement need independent differences: frames are left out that follow another one too soon.

    Args:
        estimate: joints of stored poses.
        markers: joint centres from markers.
        person: name.
        frames: to compare; those that one of the two lacks are left out.
    """
    apart, taken = PRIORS.posture_s * estimate.rate, list[int]()
    for frame in sorted(frames):
        if not taken or frame - taken[-1] >= apart:
            taken.append(frame)
    joints = tuple(name for name in markers.names if name in estimate.names)
    rows = [
        (np.flatnonzero(t.frames == f), np.flatnonzero(m.frames == f)) for f in taken for t, m in [(estimate, markers)]
    ]
    both = [(f, int(a[0]), int(b[0])) for f, (a, b) in zip(taken, rows, strict=True) if len(a) and len(b)]
    points = np.stack(
        [
            markers.points[[b for _, _, b in both]][:, [markers.names.index(j) for j in joints]],
            estimate.points[[a for _, a, _ in both]][:, [estimate.names.index(j) for j in joints]],
        ],
        axis=1,
    )  # (n, 2, joints, 3)
    names = tuple(name for name, ends in _ANGLES.items() if {*ends} <= {*joints})
    flexions = np.zeros((len(both), 2, len(names)))
    for i, name in enumerate(names):
        flexions[..., i] = _flexion(points[:, :, [joints.index(j) for j in _ANGLES[name]]])
    means = flexions.mean(axis=1)
    subjects = tuple(Subject(person, f) for f, _, _ in both)
    note = f"of each {PRIORS.posture_s:g} s one frame is compared: those between are no independent postures"
    copies = Copies(NAMES, subjects, joints, points, names, means, flexions - means[:, None], estimate.rate, (note,))
    return copies, compare(copies)


def _flexion(points: Array) -> Array:
    """Return the angle at the second of three points, (..., 3, 3), rad: 0 where they are one line."""
    above, below = points[..., 1, :] - points[..., 0, :], points[..., 2, :] - points[..., 1, :]
    cross = np.linalg.norm(np.cross(above, below), axis=-1)
    return np.asarray(np.arctan2(cross, np.sum(above * below, axis=-1)))
