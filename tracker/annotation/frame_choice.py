"""Choose the frames of a plan."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.compute.sampling import farthest_first
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.session.frame_list import parse_frames_and_ranges
from tracker.session.session import Person, Session
from tracker.session.store.stored_poses import StoredPose, read_stored_poses


class FrameChoice(NamedTuple):
    """The frames of a plan, chosen in one of four ways."""

    every: int = 0
    """Every n-th frame; 0 for another way."""
    frames: str = ""
    """Frames and ranges, such as `0,40,100:110`; empty for another way."""
    diverse: int = 0
    """Number of frames with the most diverse stored poses; 0 for another way."""
    doubted: bool = False
    """Frames whose pose is doubtful or lost."""


def choose_frames(session: Session, person: Person, choice: FrameChoice, name: str = "frames") -> list[int]:
    """Choose the frames of a person that are to be annotated, ascending.

    Args:
        session: with the person.
        person: whose stored poses are compared.
        choice: exactly one way.
        name: of the option with frames, for messages.

    Raises:
        TrackerError: frames are none of the session, or the person has no poses to choose from.
    """
    if choice.every:
        return list(range(0, session.n_frames, choice.every))
    if choice.frames:
        return parse_frames_and_ranges(choice.frames, session.n_frames, name)
    poses = read_stored_poses(session.annotations_path, person.name, person.model)
    if not poses:
        raise TrackerError(f"expected poses of {person.name} to choose from, found none; track first")
    return doubted_frames(poses) if choice.doubted else diverse_frames(poses, choice.diverse)


def diverse_frames(poses: dict[int, StoredPose], n: int) -> list[int]:
    """Choose the frames with the most diverse poses of a person, ascending.

    Poses are compared by their joints in the frame of the root part: place and heading do not count.

    Args:
        poses: by frame; those of bodies with other points than the first one's are left out.
        n: number of frames.
    """
    frames = [
        k for k, p in poses.items() if p.body.model.point_names == next(iter(poses.values())).body.model.point_names
    ]
    postures = np.array([_posture(poses[k]) for k in frames])
    return sorted(frames[i] for i in farthest_first(postures, n, np.finfo(float).tiny))


def doubted_frames(poses: dict[int, StoredPose]) -> list[int]:
    """Return the frames whose pose is doubtful or lost, ascending."""
    return [k for k, p in poses.items() if p.record.status in ("doubtful", "lost")]


def dealt(frames: Sequence[int], annotators: Sequence[str], each: bool) -> list[tuple[int, str]]:
    """Pair frames with annotators: in turns, or all frames with each; with nobody in particular if there are none."""
    if not annotators:
        return [(k, "") for k in frames]
    if each:
        return [(k, name) for name in annotators for k in frames]
    return [(k, annotators[i % len(annotators)]) for i, k in enumerate(frames)]


def _posture(pose: StoredPose) -> Array:
    """Return the joints in the frame of the root part, m, (3 * n_points,)."""
    body = pose.body
    T_root_world = np.linalg.inv(body.kinematics.Ts_world_part[0])
    features: Array = (body.joint_centers_world @ T_root_world[:3, :3].T + T_root_world[:3, 3]).ravel()
    return features
