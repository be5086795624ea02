"""Points that imported files state, placed on the poses of a session.

A detector is off from the joints of a body by about the same vector in the frame of the part above the joint. These
offsets are learnt on the poses that nobody edited, so that mended points agree with the others of their file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.geometry.arrays import Array, Mask
from tracker.interchange.observations.observed import ObservationSet
from tracker.session.session import Session
from tracker.session.store.records import SOURCES
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

PoseChoice = Literal["edited", "all"]
_MIN_OFFSETS = 5
"""Fewest frames whose median is an offset: two of them may be wrong."""
_BY_PROGRAMS = ("tracked", "smoothed", "imported")
"""Sources of values that no person set, even where a keyframe has them because a person found them right."""


@dataclass(frozen=True, eq=False)
class MendedPoints:
    """The points of one person that replace those of the files."""

    bodies: Mapping[int, PosedBody]
    """The body by frame, of the frames whose points are replaced."""
    replaced: Mapping[int, Mask]
    """Whether each point is replaced, (n_points,), on each of these frames."""
    all_bodies: Mapping[int, PosedBody]
    """The body by frame, of all frames with a pose."""
    counterparts: Sequence[tuple[str, ...]]
    """Points of the body whose mean each point is, (n_points,); empty for one that stays as it came."""
    offsets_part: Array
    """Offset of each point from its joints, in the frame of the part above the first, (n_points, 3), metres."""

    def points_world(self, body: PosedBody) -> Array:
        """Return the points of a body, (n_points, 3), metres; NaN for those that stay as they came."""
        anchors, R = _anchors(body, self.counterparts)
        return anchors + np.einsum("nij,nj->ni", R, self.offsets_part)


def mended_points(
    session: Session,
    observations: ObservationSet,
    joints_world: Array,
    poses: PoseChoice = "edited",
    learn_offsets: bool = True,
) -> list[MendedPoints]:
    """Return the points that replace those of the files, for each person of the observations.

    Args:
        session: its stored poses.
        observations: of whose points.
        joints_world: the observed joints, (n_frames, n_people, n_points, 3), metres.
        poses: replace the points that move with a value that a person edited, or those of all poses.
        learn_offsets: place points as far from the joints as the files usually do.
    """
    counterparts = tuple(observations.counterparts.values())
    people = {p.name: p for p in session.people}
    out = []
    for k, name in enumerate(observations.people):
        stored = read_stored_poses(session.annotations_path, name, people[name].model)
        inside = {f: p for f, p in stored.items() if 0 <= f < session.n_frames}
        edited = {f for f, p in inside.items() if _is_edited(p)}
        others = {f: p.body for f, p in inside.items() if f not in edited}
        offsets = np.zeros((len(counterparts), 3))
        if learn_offsets:
            offsets = _offsets(others, joints_world[:, k], counterparts)
        chosen = {f: p for f, p in inside.items() if poses == "all" or f in edited}
        every = np.ones(len(counterparts), np.bool_)
        replaced = {f: every if poses == "all" else _edited_points(p, counterparts) for f, p in chosen.items()}
        bodies = {f: p.body for f, p in inside.items()}
        out.append(MendedPoints({f: bodies[f] for f in chosen}, replaced, bodies, counterparts, offsets))
    return out


def _is_edited(pose: StoredPose) -> bool:
    return pose.record.keyframe and SOURCES.index(pose.source) < min(SOURCES.index(s) for s in _BY_PROGRAMS)


def _edited_points(pose: StoredPose, counterparts: Sequence[tuple[str, ...]]) -> Mask:
    """Return which points move with a value that a person edited, (n_points,)."""
    model, first = pose.body.model, min(SOURCES.index(s) for s in _BY_PROGRAMS)
    is_edited = np.array([SOURCES.index(s) < first for s in pose.record.sources])
    edited_dofs = is_edited[model.dof_value]  # the values of a quaternion are edited together
    is_moved = np.asarray(model.moves[edited_dofs].any(axis=0))[model.proximal_parts]
    moved = {name for name, moves in zip(model.point_names, is_moved, strict=True) if moves}
    return np.array([any(p in moved for p in points) for points in counterparts])


def _offsets(bodies: Mapping[int, PosedBody], joints_world: Array, counterparts: Sequence[tuple[str, ...]]) -> Array:
    """Return the median offset of each point, (n_points, 3); 0 for one that is seen with too few poses."""
    out = np.zeros((len(counterparts), 3))
    if len(bodies) < _MIN_OFFSETS:
        return out
    local = np.stack([_local(body, joints_world[frame], counterparts) for frame, body in bodies.items()])
    for i, column in enumerate(np.swapaxes(local, 0, 1)):
        known = column[np.isfinite(column).all(axis=-1)]
        if len(known) >= _MIN_OFFSETS:
            out[i] = np.median(known, axis=0)
    return out


def _local(body: PosedBody, points_world: Array, counterparts: Sequence[tuple[str, ...]]) -> Array:
    anchors, R = _anchors(body, counterparts)
    return np.einsum("nji,nj->ni", R, points_world - anchors)


def _anchors(body: PosedBody, counterparts: Sequence[tuple[str, ...]]) -> tuple[Array, Array]:
    """Return the mean of each point's joints, (n_points, 3), and the rotation of the part above, (n_points, 3, 3)."""
    model: BodyModel = body.model
    at = {name: i for i, name in enumerate(model.point_names)}
    centers, Ts = body.joint_centers_world, body.kinematics.Ts_world_part
    anchors, R = np.full((len(counterparts), 3), np.nan), np.tile(np.eye(3), (len(counterparts), 1, 1))
    for i, points in enumerate(counterparts):
        columns = [at[p] for p in points if p in at]
        if points and len(columns) == len(points):
            anchors[i] = centers[columns].mean(axis=0)
            R[i] = Ts[model.proximal_parts[columns[0]], :3, :3]
    return anchors, R
