"""Between two keyframes: the seam of a pose, and the stretches that are to be tracked.

The *seam* is how far the limb joints of the passes from either keyframe lie apart. It is stored in the settings of the
pose, with the keyframes that it was tracked from. A stretch is to be tracked again once these are other ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.estimation.tracking.confidence import (
    classify_limbs,
    probabilities,
    status_named,
    uncertain,
    without_uncertainty,
    worst,
)
from tracker.estimation.tracking.pose_errors import limb_odds, point_covariances
from tracker.estimation.tracking.tracker import Keyframes
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.geometry.arrays import Array
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import BETWEEN, SEAM, PoseRecord

_POSES = "keyframe_poses"
"""Key of a pose's settings: checksums of the poses of the two keyframes."""


class Seam(NamedTuple):
    """Disagreement of the two passes on a frame between two keyframes."""

    steps_m: Array
    """From each point of the selected pass to that of the other, (n_points, 3), metres."""
    between: tuple[int, int]
    """The keyframes."""
    checksums: tuple[str, ...]
    """Checksums of their poses."""

    @property
    def lengths_mm(self) -> Array:
        """Distance of each point of the body in the two passes, (n_points,), mm."""
        return 1000 * np.linalg.norm(self.steps_m, axis=1)

    def seam_mm(self, model: BodyModel) -> float:
        """Return the largest distance of a limb joint, mm; of all points for a body without limb joints.

        Head and spine are left out: a twist that no contour shows would hide what the limbs tell.
        """
        of_limbs = [name in LIMB_JOINTS for name in model.point_names]
        return float(self.lengths_mm[of_limbs if any(of_limbs) else slice(None)].max())


def seam_of(model: BodyModel, pose: Array, other: Array, between: tuple[int, int], keyframes: Sequence[Array]) -> Seam:
    """Return the seam of a frame.

    Args:
        model: the body.
        pose: by the selected pass, (n_values,).
        other: by the other pass, (n_values,).
        between: frames of the two keyframes.
        keyframes: their poses, (n_values,) each.
    """
    return Seam(model.points_world(other) - model.points_world(pose), between, tuple(map(pose_checksum, keyframes)))


def with_seam(model: BodyModel, pose: PoseRecord, seam: Seam) -> PoseRecord:
    """Return an assessed pose that also counts what the passes from its two keyframes disagree about.

    Where the errors of the passes are independent, the mean square of their difference is twice that of each.

    Args:
        model: the body.
        pose: the pose.
        seam: of the two passes on its frame.
    """
    by_seam = np.einsum("pi,pj->pij", seam.steps_m, seam.steps_m) / 2
    errors = point_covariances(model, by_seam) if pose.errors is None else pose.errors + by_seam
    odds, lengths_mm = limb_odds(model, errors), seam.lengths_mm
    status, lost = classify_limbs(odds), probabilities(odds[:, 1])
    remark, before = pose.remark, status_named(pose.status)
    if status != "good" and worst([before, status]) != before:
        limb = limbs(model)[int(odds[:, 1].argmax())]
        apart_mm = lengths_mm[np.isin(model.point_parts, limb.parts)].max()
        first, last = seam.between
        reason = f": tracked from frames {first} and {last}, it lies {apart_mm:.0f} mm apart"
        remark = ", ".join([uncertain(limb.name, reason), *without_uncertainty(remark)])
    known = pose.limbs_lost or (0.0,) * len(lost)
    return replace(
        pose,
        errors=errors,
        status=worst([before, status]),
        remark=remark,
        limbs_lost=tuple(float(max(pair)) for pair in zip(known, lost, strict=True)),
        settings={
            **pose.settings,
            BETWEEN: list(seam.between),
            SEAM: round(seam.seam_mm(model), 1),
            _POSES: list(seam.checksums),
        },
    )


def between_keyframes(keyframes: Keyframes, person: int, frames: Sequence[int]) -> dict[int, tuple[int, int]]:
    """Return the keyframes of a person before and after each of some frames that lies between two, by frame."""
    of_person = sorted(k for k, of_people in keyframes.items() if person in of_people)
    return {k: (a, b) for a, b in pairwise(of_person) for k in frames if a < k < b}


def pose_checksum(pose: Array) -> str:
    """Return a checksum of a pose, (n_values,), by which it is recognized."""
    return f"{crc32(np.asarray(pose, dtype=np.float64).tobytes()):08x}"


def is_tracked_between(settings: Mapping[str, Any], between: tuple[int, int], keyframes: Sequence[Array]) -> bool:
    """Return whether a pose with some settings was tracked from two keyframes as they are now.

    Args:
        settings: of the pose.
        between: frames of the keyframes.
        keyframes: their poses, (n_values,) each.
    """
    now = [list(between), list(map(pose_checksum, keyframes))]
    return [settings.get(BETWEEN), settings.get(_POSES)] == now


class KeyframeStretch(NamedTuple):
    """Frames between two successive keyframes of a person."""

    first: int
    """The keyframe before them."""
    last: int
    """The keyframe after them."""

    @property
    def frames(self) -> range:
        """The frames with both keyframes."""
        return range(self.first, self.last + 1)

    @property
    def between(self) -> range:
        """The frames without the keyframes; at least one."""
        return range(self.first + 1, self.last)


def stretches(store: AnnotationStore, person: str, within: range) -> list[KeyframeStretch]:
    """Return the stretches of a person between keyframes of a range, in the order of time."""
    keyframes = [row.frame for row in store.frames(person, within) if row.keyframe]
    return [KeyframeStretch(a, b) for a, b in pairwise(keyframes) if b - a > 1]


def is_tracked(store: AnnotationStore, person: str, stretch: KeyframeStretch) -> bool:
    """Return whether all poses of a stretch were tracked from its keyframes as they are now."""
    records = store.poses(person, stretch.frames)
    ends = [records[k].values for k in (stretch.first, stretch.last)]
    between = [records.get(k) for k in stretch.between]
    return all(r is not None and is_tracked_between(r.settings, (stretch.first, stretch.last), ends) for r in between)


def stretches_to_track(
    session: Session, store: AnnotationStore, people: Sequence[int], within: range
) -> dict[tuple[int, ...], list[KeyframeStretch]]:
    """Return the stretches that are to be tracked, by the indices of the people whose stretches they are.

    After the correction of a keyframe, these are the two beside it.

    Args:
        session: whose people they are.
        store: its annotations.
        people: indices of the people.
        within: frames that are looked at.

    Raises:
        TrackerError: nobody has two keyframes with other frames between them.
    """
    known = {i: stretches(store, session.people[i].name, within) for i in people}
    if not any(known.values()):
        raise TrackerError(
            f"expected two keyframes with other frames between them in frames {within[0]} to {within[-1]}, found none",
            Remedy("set_keyframes"),
        )
    owners: dict[KeyframeStretch, tuple[int, ...]] = {}
    for i, own in known.items():
        for stretch in own:
            if not is_tracked(store, session.people[i].name, stretch):
                owners[stretch] = (*owners.get(stretch, ()), i)
    out: dict[tuple[int, ...], list[KeyframeStretch]] = {}
    for stretch, who in sorted(owners.items()):
        out.setdefault(who, []).append(stretch)
    return out


def frames_of(some: Sequence[KeyframeStretch]) -> list[int]:
    """Return the frames of some stretches with their keyframes, ascending, each once."""
    return sorted({k for stretch in some for k in stretch.frames})
