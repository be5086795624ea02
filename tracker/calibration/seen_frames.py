"""Frames from which cameras are judged: what the views show there, and which of it the present cameras accept."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.acquisition.from_contours import own_views
from tracker.body.model import BodyModel, PosedBody
from tracker.calibration.camera_correction import TIME, corrected
from tracker.calibration.rig_problem import RigState, SeenPerson
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence, with_all_segments, with_segments
from tracker.geometry.arrays import Array
from tracker.images.edge_segments import accept_segments


class SeenFrame(NamedTuple):
    """People on a frame, and all that the views show around them."""

    frame: int
    views: tuple[ViewEvidence, ...]
    """With their segments."""
    bodies: tuple[PosedBody, ...]
    """All people, as they were tracked."""
    velocities: tuple[Array, ...]
    """Change of each person's pose, (n_dofs,), rad or metres per second."""


def seen_people(frames: Sequence[SeenFrame], state: RigState | None = None) -> list[SeenPerson]:
    """Return the evidence of each person on each frame.

    Args:
        frames: the frames.
        state: cameras and poses by which segments are accepted; None takes all segments that may be a person's.
    """
    out, poses = [], iter(()) if state is None else iter(state.poses)
    for seen in frames:
        bodies = seen.bodies
        if state is None:
            views: Sequence[ViewEvidence] = [with_all_segments(v) for v in seen.views]
        else:
            bodies = tuple(PosedBody(b.model, next(poses)) for b in seen.bodies)
            views = [
                _accepted(view, bodies, seen.velocities, c)
                for view, c in zip(seen.views, state.corrections, strict=True)
            ]
        for person, velocity in enumerate(seen.velocities):
            own = own_views(views, bodies, person) if len(bodies) > 1 else views
            out.append(SeenPerson(seen.frame, person, own, bodies, velocity))
    return out


def _accepted(
    view: ViewEvidence, bodies: Sequence[PosedBody], velocities: Sequence[Array], correction: Array
) -> ViewEvidence:
    """Return a view with the segments that the contours of people accept under a corrected camera."""
    if view.segments is None or view.samples is None:
        return view
    then = [
        PosedBody(b.model, b.model.retract(b.values, correction[TIME] * v))
        for b, v in zip(bodies, velocities, strict=True)
    ]
    contour = occluding_contours.trace(then, corrected(view.camera, correction))
    pieces = contour.pieces_px[~contour.occluded]
    chosen = accept_segments(view.samples, pieces, ACCEPTED_SHARE * view.theta_px)
    return with_segments(view, chosen if view.is_static is None else chosen & ~view.is_static)


def velocity(model: BodyModel, poses: Sequence[Array], fps: float) -> Array:
    """Return the change of a pose by central differences, averaged over three frames, (n_dofs,), per second.

    Args:
        model: the body.
        poses: of two frames before, one before, the frame, one after and two after, (n_values,).
        fps: frames per second.
    """
    return np.asarray(sum(model.difference(poses[i + 2], poses[i]) for i in range(3)) * (fps / 6))


def spread_poses(joints: Array, n: int) -> list[int]:
    """Choose frames with poses as different as possible, in order.

    Each is the one farthest from those before (Gonzalez 1985), by the root mean square distance of its joints.

    Args:
        joints: of each frame, (F, J, 3), metres.
        n: number of frames to choose.
    """
    flat = joints.reshape(len(joints), -1)
    chosen = [int(np.argmin(np.linalg.norm(flat - flat.mean(axis=0), axis=1)))]
    nearest = np.linalg.norm(flat - flat[chosen[0]], axis=1)
    while len(chosen) < min(n, len(joints)):
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(flat - flat[chosen[-1]], axis=1))
    return sorted(chosen)


def at_sizes(frames: Sequence[SeenFrame], bodies: Sequence[BodyModel]) -> list[SeenFrame]:
    """Return frames with people in bodies of other sizes, in the same poses."""
    return [
        f._replace(bodies=tuple(PosedBody(model, b.values) for model, b in zip(bodies, f.bodies, strict=True)))
        for f in frames
    ]


def nothing_seen(view: ViewEvidence) -> ViewEvidence:
    """Return a view without its points, which then does not count."""
    return replace(view, points_px=view.points_px[:0], silhouette=None)
