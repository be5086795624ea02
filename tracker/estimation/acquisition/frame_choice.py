"""Choose the frames from which the sizes of a body are acquired: those whose poses show the unknown sizes best.

The contours of a frame carry information about the sizes, whatever the pose is: the Schur complement of their normal
matrix. Frames are added one at a time, each the one that shrinks the uncertainty of all sizes most (the determinant of
their covariance, D-optimality; e.g. Fedorov 1972).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.estimation.acquisition.part_motions import motions_by_unknowns
from tracker.estimation.acquisition.piece_sums import GroupSums, sums_of_views
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.contour_residuals import MatchSettings, PieceSums
from tracker.evidence.contours import occluding_contours
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import Camera

_POSE_WEIGHT = 10.0
"""Weight of a known pose, per radian or metre: little, as poses are found together with the sizes."""


def choose_frames(
    parameters: SizeParameters,
    cameras: Sequence[Camera],
    bodies: Mapping[int, tuple[PosedBody, ...]],
    person: int,
    n_frames: int,
    fixed: Sequence[int] = (),
) -> list[int]:
    """Choose frames for an acquisition, in order.

    Args:
        parameters: the sizes to acquire; the body is that of the poses.
        cameras: all views, without lens distortion.
        bodies: all people on each frame to choose from.
        person: index of the person among them.
        n_frames: number of frames to choose, with those that are fixed.
        fixed: frames that are used in any case.
    """
    information = {k: _information(parameters, cameras, b, person) for k, b in bodies.items()}
    known = np.diag(1 / parameters.sigmas**2) + sum(information[k] for k in fixed)
    chosen = list(fixed)
    while len(chosen) < min(n_frames, len(bodies)):
        gains = {k: float(np.linalg.slogdet(known + f)[1]) for k, f in information.items() if k not in chosen}
        best = max(gains, key=lambda k: gains[k])
        chosen.append(best)
        known = known + information[best]
    return sorted(chosen)


def _information(
    parameters: SizeParameters, cameras: Sequence[Camera], bodies: Sequence[PosedBody], person: int
) -> Array:
    """Return the information matrix of the sizes by the visible contours of a frame, (n_sizes, n_sizes)."""
    body, (model, kinematics) = bodies[person], (bodies[person].model, bodies[person].kinematics)
    first, n = parts_of([b.model for b in bodies], person).start, len(parameters.names)
    J = motions_by_unknowns(model, kinematics, parameters.derivatives(np.zeros(n)))
    contours = [occluding_contours.trace(bodies, c) for c in cameras]
    views = [(c, _visible_pieces(contour, first, body, c)) for c, contour in zip(cameras, contours, strict=True)]
    sums = GroupSums.zeros(0, J.shape[2])
    sums.add_body(sums_of_views(views, model, kinematics, J.shape[1]), J, np.zeros((0, J[:, :, 0].size)))
    H = sums.hessian
    by_pose = H[n:, n:] + np.eye(model.n_dofs) * _POSE_WEIGHT
    return np.asarray(H[:n, :n] - H[:n, n:] @ np.linalg.solve(by_pose, H[n:, :n]))


def _visible_pieces(contour: occluding_contours.Contour, first: int, body: PosedBody, camera: Camera) -> PieceSums:
    """Return the visible pieces of a body within the image, each with the information of a contour."""
    model: BodyModel = body.model
    middles = (contour.pieces_px[:, :2] + contour.pieces_px[:, 2:]) / 2
    parts = contour.parts.astype(np.int64) - first
    inside = np.all((middles >= 0) & (middles < camera.size), axis=1)
    own = ~contour.occluded & (parts >= 0) & (parts < len(model.parts)) & inside
    parts, along = parts[own], contour.pieces_px[own, 2:] - contour.pieces_px[own, :2]
    lengths = np.maximum(np.linalg.norm(along, axis=1), TINY)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / lengths[:, None]
    T = body.kinematics.Ts_world_part[parts]
    local = np.einsum("nji,nj->ni", T[:, :3, :3], contour.points_world[own] - T[:, :3, 3])
    unit_points = (local - model.centers_part[parts]) / np.array([s.half_axes for s in model.shapes])[parts]
    weights = MatchSettings().information_per_px * lengths
    squares = np.asarray(weights[:, None, None] * normals[:, :, None] * normals[:, None, :], np.float64)
    return PieceSums(parts, middles[own].astype(np.float64), unit_points, np.zeros((len(parts), 2)), squares)
