"""Exported poses as arrays over frames, people and points, for files that are arrays."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.exports.export_format import Tick
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world
from tracker.interchange.exports.provenance import pose_provenance


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
    by_pose: dict[str, NDArray[Any]]
    """`PoseProvenance.fields` of each pose by name, (F, P); empty, False or 0 without one."""

    @property
    def errors_m(self) -> Array:
        """Root mean square error of each joint centre, (F, P, n), metres; NaN where not known."""
        return np.asarray(np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)))

    @property
    def confidence(self) -> Array:
        """Probability that the limb of each point is not lost, (F, P, n): 1 where not assessed, NaN without a point."""
        return np.where(np.isnan(self.joints[..., 0]), np.nan, 1.0 - np.nan_to_num(self.point_lost))


def pose_arrays(motion: ExportedMotion, options: ExportOptions, tick: Tick = lambda: None) -> PoseArrays:
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
        by_pose={},
    )
    by_pose: dict[str, NDArray[Any]] = {}
    T_file_world = file_from_world(motion.session, options.axes)
    for i, frame in enumerate(motion.frames):
        for j, person in enumerate(people):
            if frame not in person.poses:
                continue
            body, found = person.poses[frame].body, pose_provenance(motion, person, frame)
            at = (i, j, columns[body.model])
            out.joints[at] = rigid.apply(T_file_world, body.joint_centers_world)
            out.covariances[at] = found.covariances(T_file_world[:3, :3])
            out.point_sources[at], out.point_lost[at] = found.point_sources, found.point_lost
            for name, value in found.fields.items():
                by_pose.setdefault(name, np.full(shape, type(value)(), object))[i, j] = value
        tick()
    out.by_pose.update({name: found.astype(type(found[0, 0])) for name, found in by_pose.items()})
    return out


def pose_values(motion: ExportedMotion) -> tuple[list[str], Array]:
    """Return the names of the values of all bodies, and the values of each pose, (F, P, n_values); NaN without one."""
    names = list(dict.fromkeys(v for person in motion.exported for model in person.models for v in model.value_names))
    poses = np.full((len(motion.frames), len(motion.exported), len(names)), np.nan)
    for j, person in enumerate(motion.exported):
        for i, frame in enumerate(motion.frames):
            if stored := person.poses.get(frame):
                poses[i, j, [names.index(v) for v in stored.body.model.value_names]] = stored.body.values
    return names, poses
