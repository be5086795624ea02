"""Residuals of key points: positions in pictures, with standard deviations, at which a detector saw a person.

They are robust (Geman-McClure): a detector that exchanges sides or takes a limb for another is not off by noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics, place_point
from tracker.body.model import BodyModel
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.fitting.clocked_residuals import at_time
from tracker.estimation.fitting.gauss_newton import NormalEquations, ResidualBlock
from tracker.evidence.keypoints import ViewKeypoints
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

GROSS_SIGMAS = 3.0
"""Standard deviations from which an error counts as gross: beyond, its influence falls (Geman-McClure). Of normal
errors in two coordinates, 1% are larger."""


class KeypointTerm(NamedTuple):
    """Arguments of `add_keypoints`."""

    parts: IntArray
    """Part that each point moves with, (N,)."""
    points_part: Array
    """Place of each in its part, (N, 3), metres."""
    projections: Array
    """Projection matrix of the view of each, (N, 3, 4)."""
    positions_px: Array
    """Its observed position, (N, 2), px."""
    precisions: Array
    """Inverse variance of each, (N,), 1/px^2."""


NO_KEYPOINTS = KeypointTerm(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3, 4)), np.empty((0, 2)), np.empty(0))
"""A term that adds nothing."""


@dataclass(frozen=True, eq=False)
class KeypointBlock:
    """Points of a body drawn to where a detector saw them; see `ResidualBlock`."""

    arrays: KeypointTerm

    @classmethod
    def of(cls, seen: Sequence[tuple[Camera, ViewKeypoints]]) -> "KeypointBlock":
        """Return the residuals of a person's key points in some views, one or more."""
        own = [(camera.projection, k) for camera, k in seen]
        return cls(
            KeypointTerm(
                np.concatenate([k.parts for _, k in own]),
                np.concatenate([k.points_part for _, k in own]),
                np.repeat([P for P, _ in own], [len(k.parts) for _, k in own], axis=0),  # contiguous: compiled once
                np.concatenate([k.positions_px for _, k in own]),
                np.concatenate([1 / k.sigmas_px**2 for _, k in own]),
            )
        )

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        parts, points, P, px, precisions = self.arrays
        T = kinematics.Ts_world_part[parts]
        X = np.einsum("nij,nj->ni", T[:, :3, :3], points) + T[:, :3, 3]
        h = np.einsum("nij,nj->ni", P[:, :, :3], X) + P[:, :, 3]
        in_front = h[:, 2] > NEAR_PLANE_M
        z = np.where(in_front, h[:, 2], 1.0)[:, None]
        uv = h[:, :2] / z
        squares = np.where(in_front, precisions * ((uv - px) ** 2).sum(axis=1), 0.0)
        share = GROSS_SIGMAS**2 / (GROSS_SIGMAS**2 + squares)
        weights = np.where(in_front, precisions * share**2, 0.0)
        by_points = (P[:, :2, :3] - uv[:, :, None] * P[:, 2:, :3]) / z[:, :, None]
        J = by_points @ model.point_jacobian(kinematics, parts, X)
        return NormalEquations(
            0.5 * float(np.sum(squares * share)),
            np.einsum("n,nik,ni->k", weights, J, uv - px),
            np.einsum("n,nik,nim->km", weights, J, J),
        )


def keypoints_of(view: ViewEvidence, person: int) -> ViewKeypoints | None:
    """Return the key points of a person in a view; None if there is none."""
    own = view.keypoints[person] if person < len(view.keypoints) else None
    return own if own is not None and len(own.parts) else None


def keypoint_blocks(views: Sequence[ViewEvidence], person: int, velocity: Array | None) -> list[ResidualBlock]:
    """Return the residuals of a person's key points, one block for the views of each time.

    Args:
        views: what they show.
        person: index of the person.
        velocity: change of the person's pose from one frame to the next, (n_dofs,); None: all views count as of the
            time of the frame.
    """
    by_time = dict[float, list[tuple[Camera, ViewKeypoints]]]()
    for view in views:
        own = keypoints_of(view, person)
        if own is not None:
            by_time.setdefault(0.0 if velocity is None else view.ahead_frames, []).append((view.camera, own))
    return [at_time(KeypointBlock.of(seen), velocity, time) for time, seen in by_time.items()]


@njit(**NO_REFCOUNT)
def add_keypoints(term: KeypointTerm, Ts: Array, M: Array, b: Array) -> float:
    """Add the normal equations of key points to those of the parts' twists; return the cost. See `twists`.

    Args:
        term: the key points.
        Ts: poses of the parts of the body, (n_parts, 4, 4).
        M: normal matrices of the twists, upper triangles, (n_parts, 6, 6).
        b: their gradients, (n_parts, 6).
    """
    cost = 0.0
    for n in range(term.parts.shape[0]):
        p, P = term.parts[n], term.projections[n]
        X, Y, Z = place_point(Ts[p], term.points_part[n])
        depth = P[2, 0] * X + P[2, 1] * Y + P[2, 2] * Z + P[2, 3]
        if depth <= NEAR_PLANE_M:
            continue
        u = (P[0, 0] * X + P[0, 1] * Y + P[0, 2] * Z + P[0, 3]) / depth
        v = (P[1, 0] * X + P[1, 1] * Y + P[1, 2] * Z + P[1, 3]) / depth
        du, dv = u - term.positions_px[n, 0], v - term.positions_px[n, 1]
        square = term.precisions[n] * (du * du + dv * dv)
        share = GROSS_SIGMAS**2 / (GROSS_SIGMAS**2 + square)
        weight = term.precisions[n] * share * share
        cost += 0.5 * square * share
        a3, a4, a5 = (P[0, 0] - u * P[2, 0]) / depth, (P[0, 1] - u * P[2, 1]) / depth, (P[0, 2] - u * P[2, 2]) / depth
        c3, c4, c5 = (P[1, 0] - v * P[2, 0]) / depth, (P[1, 1] - v * P[2, 1]) / depth, (P[1, 2] - v * P[2, 2]) / depth
        a = (Y * a5 - Z * a4, Z * a3 - X * a5, X * a4 - Y * a3, a3, a4, a5)
        c = (Y * c5 - Z * c4, Z * c3 - X * c5, X * c4 - Y * c3, c3, c4, c5)
        for i in range(6):
            b[p, i] += weight * (du * a[i] + dv * c[i])
            for j in range(i, 6):
                M[p, i, j] += weight * (a[i] * a[j] + c[i] * c[j])
    return cost
