"""Compare the poses of annotators: joint by joint, angle by angle, frame by frame, and each against the consensus.

Differences are those of the second annotator less the first, in the axes of the world. Of several annotators, figures
are of the pair with the largest bias, and their intervals allow for that choice (`statistics.limits_of_agreement`). An
interval is of one joint or angle: of twenty without a systematic difference, one may show a bias.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.evaluation.agreement.copies import Copies, Subject, mean_points
from tracker.evaluation.agreement.statistics import Icc, Limits, icc_agreement, limits_of_agreement, mean_squares
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class JointAgreement:
    """Agreement of two or more annotators on the place of a joint, metres."""

    pair: tuple[str, str]
    """The two annotators that bias and limits are of; of several, those with the largest bias."""
    n: int
    """Number of subjects: a person in a frame."""
    bias_m: Array
    """Mean difference, (3,)."""
    along: Limits
    """Of the difference along the line of the bias, so that its bias is the length of `bias_m`.

    Its intervals hold for all lines in space at once, since the differences themselves chose this one. That of the bias
    reaches 0 or less unless the bias is certain. Three subjects or fewer determine none."""
    by_axis: tuple[Limits, ...]
    """Of the difference along each axis of the world; intervals are of one axis."""
    typical_error_m: float
    """Along the line of the bias, of all annotators."""
    typical_error_by_axis_m: tuple[float, ...]
    icc: Icc
    """Of all annotators, with mean squares summed over the axes."""
    icc_by_axis: tuple[Icc, ...]
    mean_distance_m: float
    """Mean distance between the pair."""
    p95_distance_m: float
    """95th percentile of the distance between the pair."""
    differences_m: Array
    """Difference of the pair along the line of the bias, for plots, (n,)."""
    means_m: Array
    """Mean place of the pair along that line, (n,)."""


@dataclass(frozen=True, eq=False)
class AngleAgreement:
    """Agreement of two or more annotators on an angle, rad."""

    pair: tuple[str, str]
    """As for a joint."""
    n: int
    limits: Limits
    """Of the difference, the shorter way round."""
    typical_error_rad: float
    """Of all annotators."""
    icc: Icc
    """Of all annotators; NaN for ball joints."""


@dataclass(frozen=True, eq=False)
class AnnotatorAgreement:
    """An annotator against the consensus of all, metres."""

    mean_distance_m: float
    """Over subjects and joints; NaN, like the next, if the bodies have no joint in common."""
    p95_distance_m: float
    bias_m: Mapping[str, Array]
    """Mean difference of each joint from the consensus, (3,)."""
    joint_distance_m: Mapping[str, float]
    """Mean distance of each joint from the consensus."""


class Disagreement(NamedTuple):
    """The joint on which two annotators differ most in a pose."""

    subject: Subject
    joint: str
    distance_m: float
    pair: tuple[str, str]


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of annotators."""

    annotators: Mapping[str, AnnotatorAgreement]
    joints: Mapping[str, JointAgreement]
    angles: Mapping[str, AngleAgreement]
    worst: tuple[Disagreement, ...]
    """One for each subject whose bodies have a joint in common, the largest distance first."""


def compare(copies: Copies, annotators: Sequence[int] | None = None, people: Sequence[str] | None = None) -> Agreement:
    """Compare the poses of annotators.

    Args:
        copies: their poses.
        annotators: indices of those to compare; all by default.
        people: names of those to compare; all by default.
    """
    some = slice(None) if annotators is None else list(annotators)
    rows = [i for i, s in enumerate(copies.subjects) if people is None or s.person in people]
    names = copies.names if annotators is None else tuple(copies.names[i] for i in annotators)
    points, steps = copies.points[rows][:, some], copies.angle_steps[rows][:, some]
    known = np.asarray(np.isfinite(points).all(axis=(1, 3)))
    joints = {
        joint: _joint(points[known[:, i], :, i], names) for i, joint in enumerate(copies.joints) if known[:, i].any()
    }
    angles = {}
    for i, name in enumerate(copies.angles):
        has = np.isfinite(steps[:, :, i]).all(axis=1)
        if has.any():
            angles[name] = _angle(copies.angle_means[rows][has, i], steps[has][:, :, i], names)
    return Agreement(
        _against_consensus(points, copies.joints, names),
        joints,
        angles,
        tuple(_worst(points, [copies.subjects[i] for i in rows], copies.joints, names)),
    )


def _joint(points: Array, names: tuple[str, ...]) -> JointAgreement:
    """Compare places of a joint, (n, k, 3), metres."""
    biases = {(a, b): (points[:, b] - points[:, a]).mean(axis=0) for a, b in combinations(range(len(names)), 2)}
    a, b = max(biases, key=lambda pair: float(np.linalg.norm(biases[pair])))
    bias, difference = biases[a, b], points[:, b] - points[:, a]
    length = float(np.linalg.norm(bias))
    line = bias / length if length > 0 else np.array([1.0, 0.0, 0.0])  # equal on average: any line passes through 0
    distance = np.linalg.norm(difference, axis=-1)
    return JointAgreement(
        (names[a], names[b]),
        len(points),
        bias,
        limits_of_agreement(difference @ line, dimensions=points.shape[-1], chosen_of=len(biases)),
        tuple(limits_of_agreement(d, chosen_of=len(biases)) for d in difference.T),
        mean_squares(points @ line).typical_error,
        tuple(mean_squares(points[..., axis]).typical_error for axis in range(3)),
        icc_agreement(mean_squares(points)),
        tuple(icc_agreement(mean_squares(points[..., axis])) for axis in range(3)),
        float(distance.mean()),
        float(np.quantile(distance, 0.95)),
        difference @ line,
        points[:, [a, b]].mean(axis=1) @ line,
    )


def _angle(means: Array, steps: Array, names: tuple[str, ...]) -> AngleAgreement:
    """Compare an angle by its consensus, (n,), and the steps from there to each annotator, (n, k), rad."""
    pairs = list(combinations(range(len(names)), 2))
    a, b = max(pairs, key=lambda pair: abs((steps[:, pair[1]] - steps[:, pair[0]]).mean()))
    return AngleAgreement(
        (names[a], names[b]),
        len(steps),
        limits_of_agreement(steps[:, b] - steps[:, a], chosen_of=len(pairs)),
        mean_squares(steps).typical_error,
        icc_agreement(mean_squares(means[:, None] + steps)),
    )


def _against_consensus(points: Array, joints: Sequence[str], names: Sequence[str]) -> dict[str, AnnotatorAgreement]:
    steps = points - mean_points(points)[:, None]
    out = {}
    for i, name in enumerate(names):
        distance = np.linalg.norm(steps[:, i], axis=-1)
        columns = [(j, m) for m, j in enumerate(joints) if np.isfinite(distance[:, m]).any()]
        finite = distance[np.isfinite(distance)]
        out[name] = AnnotatorAgreement(
            float(finite.mean()) if finite.size else np.nan,
            float(np.quantile(finite, 0.95)) if finite.size else np.nan,
            {j: np.nanmean(steps[:, i, m], axis=0) for j, m in columns},
            {j: float(np.nanmean(distance[:, m])) for j, m in columns},
        )
    return out


def _worst(
    points: Array, subjects: Sequence[Subject], joints: Sequence[str], names: Sequence[str]
) -> list[Disagreement]:
    pairs = list(combinations(range(len(names)), 2))
    out = []
    for subject, of in zip(subjects, points, strict=True):
        distance = np.array([np.linalg.norm(of[b] - of[a], axis=-1) for a, b in pairs])
        if not np.isfinite(distance).any():
            continue
        pair, joint = np.unravel_index(int(np.nanargmax(distance)), distance.shape)
        a, b = pairs[int(pair)]
        out.append(Disagreement(subject, joints[int(joint)], float(distance[pair, joint]), (names[a], names[b])))
    return sorted(out, key=lambda d: (-d.distance_m, d.subject))
