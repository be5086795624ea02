"""Exported poses as arrays over frames, people and points, for files that are arrays."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world
from tracker.interchange.exports.provenance import PoseProvenance, pose_provenance

POSE_FIELDS = ("status", "source", "annotator", "edit_time", "program", "remark", "verified_by", "verified_time")
"""Texts of a pose in `PoseArrays.texts`."""


@dataclass(frozen=True, eq=False)
class PoseArrays:
    """The poses of F frames, P people and n points. Those of a person who has none in a frame are NaN or empty."""

    frames: IntArray
    """Frames of the session, (F,), ascending."""
    times_s: Array
    """Their times, (F,)."""
    people: tuple[str, ...]
    """Names, (P,)."""
    points: tuple[str, ...]
    """Names of the points of all bodies, (n,)."""
    bones: tuple[tuple[str, str], ...]
    """Pairs of points that a stick figure connects."""
    joints: Array
    """Joint centres, (F, P, n, 3), metres, in the axes of the file; NaN also for points that a body lacks."""
    covariances: Array
    """Of the joint centres in the axes of the file, (F, P, n, 3, 3), m^2; NaN where not known."""
    point_sources: NDArray[np.str_]
    """Source of each point, (F, P, n)."""
    point_lost: Array
    """Probability that the limb of each point is lost, (F, P, n); NaN where not assessed."""
    texts: dict[str, NDArray[np.str_]]
    """By `POSE_FIELDS`, (F, P)."""
    keyframe: NDArray[np.bool_]
    """(F, P)."""
    reviewed: NDArray[np.bool_]
    """(F, P)."""
    body_revision: IntArray
    """(F, P); 0 without a pose."""
    calibration_revision: IntArray
    """(F, P); 0 without a pose."""
    earlier_calibration: NDArray[np.bool_]
    """Whether the session has another calibration now, (F, P)."""

    @property
    def by_pose(self) -> dict[str, NDArray[Any]]:
        """The values of each pose by name, (F, P)."""
        return {
            **self.texts,
            "keyframe": self.keyframe,
            "reviewed": self.reviewed,
            "body_revision": self.body_revision,
            "calibration_revision": self.calibration_revision,
            "earlier_calibration": self.earlier_calibration,
        }

    @property
    def errors_m(self) -> Array:
        """Root mean square error of each joint centre, (F, P, n), metres; NaN where not known."""
        return np.asarray(np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)))

    @property
    def confidence(self) -> Array:
        """Probability that the limb of each point is not lost, (F, P, n): 1 where not assessed, NaN without a point."""
        return np.where(np.isnan(self.joints[..., 0]), np.nan, 1.0 - np.nan_to_num(self.point_lost))


def pose_arrays(motion: ExportedMotion, options: ExportOptions, tick: Callable[[], None] = lambda: None) -> PoseArrays:
    """Return the exported poses and their provenance as arrays, in the axes of a file; call `tick` after each frame."""
    models = [model for person in motion.exported for model in person.models]
    names = tuple(dict.fromkeys(name for model in models for name in model.point_names))
    bones = tuple(dict.fromkeys(bone for model in models for bone in model.bones))
    columns = {model: [names.index(n) for n in model.point_names] for model in models}
    people = motion.exported
    shape = (len(motion.frames), len(people))
    out = PoseArrays(
        frames=np.array(motion.frames),
        times_s=np.array([motion.time_s(f) for f in motion.frames]),
        people=tuple(p.person.name for p in people),
        points=names,
        bones=bones,
        joints=np.full((*shape, len(names), 3), np.nan),
        covariances=np.full((*shape, len(names), 3, 3), np.nan),
        point_sources=np.full((*shape, len(names)), "", "<U16"),
        point_lost=np.full((*shape, len(names)), np.nan),
        texts={},
        keyframe=np.zeros(shape, bool),
        reviewed=np.zeros(shape, bool),
        body_revision=np.zeros(shape, np.int64),
        calibration_revision=np.zeros(shape, np.int64),
        earlier_calibration=np.zeros(shape, bool),
    )
    texts = {name: np.full(shape, "", object) for name in POSE_FIELDS}
    T_file_world = file_from_world(motion.session, options.axes)
    for i, frame in enumerate(motion.frames):
        for j, person in enumerate(people):
            if frame not in person.poses:
                continue
            body, found = person.poses[frame].body, pose_provenance(motion, person, frame)
            _set_pose(out, (i, j), columns[body.model], found, T_file_world)
            out.joints[i, j, columns[body.model]] = rigid.apply(T_file_world, body.joint_centers_world)
            for name, text in _texts(found).items():
                texts[name][i, j] = text
        tick()
    out.texts.update({name: found.astype(str) for name, found in texts.items()})
    return out


def _set_pose(
    out: PoseArrays,
    at: tuple[int, int],
    columns: list[int],
    found: PoseProvenance,
    T_file_world: Array,
) -> None:
    """Write the provenance of a pose into the arrays."""
    out.covariances[at][columns] = found.covariances(T_file_world[:3, :3])
    out.point_sources[at][columns] = found.point_sources
    out.point_lost[at][columns] = found.point_lost
    out.keyframe[at], out.reviewed[at] = found.record.keyframe, found.is_reviewed
    out.body_revision[at] = found.record.model_revision
    out.calibration_revision[at] = found.calibration_revision
    out.earlier_calibration[at] = found.is_earlier_calibration


def _texts(found: PoseProvenance) -> dict[str, str]:
    record = found.record
    made = (record.status, found.source, record.author, record.time, record.program, record.remark)
    values = (*made, found.verified_by, found.verified_time)
    return dict(zip(POSE_FIELDS, values, strict=True))


def pose_values(motion: ExportedMotion) -> tuple[list[str], Array]:
    """Return the names of the values of all bodies, and the values of each pose, (F, P, n_values); NaN without one."""
    names = list(dict.fromkeys(v for person in motion.exported for model in person.models for v in model.value_names))
    poses = np.full((len(motion.frames), len(motion.exported), len(names)), np.nan)
    for j, person in enumerate(motion.exported):
        for i, frame in enumerate(motion.frames):
            if stored := person.poses.get(frame):
                poses[i, j, [names.index(v) for v in stored.body.model.value_names]] = stored.body.values
    return names, poses
