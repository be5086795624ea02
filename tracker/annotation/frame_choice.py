"""Choose the frames of a plan."""

from collections.abc import Sequence

import numpy as np

from tracker.geometry.arrays import Array, IntArray
from tracker.store.stored_poses import StoredPose


def spread_choice(points: Array, n: int) -> IntArray:
    """Choose points far from one another (farthest-point sampling, Gonzalez 1985).

    The first one is the point nearest the mean. Each further one is the point farthest from all that are chosen.

    Args:
        points: (N, D).
        n: number to choose; all points if there are fewer distinct ones.

    Returns:
        Indices in the order of choice, (at most n,).
    """
    if not len(points) or n < 1:
        return np.empty(0, dtype=np.int64)
    chosen = [int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    distances = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < n and distances.max() > 0:
        chosen.append(int(np.argmax(distances)))
        distances = np.minimum(distances, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


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
    chosen = spread_choice(np.array([_posture(poses[k]) for k in frames]), n)
    return sorted(frames[i] for i in chosen)


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
    found: Array = (body.joint_centers_world @ T_root_world[:3, :3].T + T_root_world[:3, 3]).ravel()
    return found
