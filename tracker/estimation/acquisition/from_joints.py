"""Prepare an acquisition from known joints of a recording: the height that they imply, and poses fitted to them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.segment_lengths import segment_lengths
from tracker.estimation.fitting.gauss_newton import JOINT_M, PointTargets, fit_to_points
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array

_CREDIBLE = (0.6, 1.6)
"""A measured segment outside this range of the model's length is an error in the joints."""


class JointFrames(NamedTuple):
    """A body posed at known joints on several frames."""

    bodies: dict[int, tuple[PosedBody, ...]]
    """The body on each frame."""
    placed: dict[int, PointTargets]
    """The known joints of each frame."""


def place_joints(model: BodyModel, places_world: Mapping[str, Array], sigma_m: float = JOINT_M) -> PointTargets:
    """Return the limb joints of a body that are known, as targets.

    Args:
        model: the body.
        places_world: position of each joint by name, (3,), metres; NaN and other points are ignored.
        sigma_m: standard deviation of a position, metres.
    """
    names = [n for n in LIMB_JOINTS if n in model.point_names and n in places_world]
    known = [n for n in names if np.all(np.isfinite(places_world[n]))]
    points = np.array([model.point_names.index(n) for n in known], dtype=np.int64)
    targets = np.array([places_world[n] for n in known], dtype=np.float64).reshape(-1, 3)
    return PointTargets(points, targets, np.full(len(known), 1 / sigma_m))


def height_from_joints(model: BodyModel, joints: MarkerTable) -> float:
    """Return the height, metres, at which the body's segments are on average as long as those of measured joints.

    Args:
        model: the body, of any height.
        joints: joints under the project's names, metres.

    Raises:
        TrackerError: the joints lack a segment, or give one a length that no body of this kind has.
    """
    own = model.named_points_world(model.neutral())
    measured = {n: joints.points[:, i] for i, n in enumerate(joints.names)}
    of_body = segment_lengths(own)
    logs = {n: np.log(length_m / of_body[n]) for n, length_m in segment_lengths(measured).items()}
    middle = float(np.median(list(logs.values())))
    for name, log in logs.items():
        ratio = float(np.exp(log - middle))
        if not _CREDIBLE[0] <= ratio <= _CREDIBLE[1]:
            raise TrackerError(
                f"fitting sizes: the {name} came out {ratio:.2f} times as long as in a body of these joints' size; "
                f"expected {_CREDIBLE[0]} to {_CREDIBLE[1]}",
                Remedy("check_joint_map"),
            )
    return model.height_m * float(np.exp(np.mean(list(logs.values()))))


def pose_at_joints(model: BodyModel, joints: MarkerTable, frames: Sequence[int]) -> JointFrames:
    """Fit a body to the joints of some frames. Frames with fewer than four joints, or odd ones, are left out."""
    poses, misfits, placed = dict[int, Array](), dict[int, float](), dict[int, PointTargets]()
    for frame, row in zip(joints.frames.tolist(), joints.points, strict=True):
        targets = place_joints(model, dict(zip(joints.names, row, strict=True)))
        if frame not in frames or len(targets.points) < 4:
            continue
        names = [model.point_names[i] for i in targets.points]
        poses[frame] = fit_to_points(model, dict(zip(names, targets.targets_world, strict=True))).pose
        found = model.points_world(poses[frame])[targets.points]
        misfits[frame] = float(np.linalg.norm(found - targets.targets_world, axis=1).mean())
        placed[frame] = targets
    most = GROSS_SIGMAS * float(np.median(list(misfits.values()) or [0.0]))
    usual = [k for k, misfit in misfits.items() if misfit <= most]
    return JointFrames({k: (PosedBody(model, poses[k]),) for k in usual}, {k: placed[k] for k in usual})
