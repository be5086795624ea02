"""Learn how a detector sees a body: the offset of each key point from its joint, and its standard deviation.

Detectors are consistently off, at hips and shoulders by some centimetres. A body that is posed by other evidence, or by
all key points together, shows by how much.

The observed points of one person that are points of the body, over all frames and views.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.estimation.fitting.gauss_newton import (
    OTHER_BODY_M,
    PointTargets,
    PosePrior,
    ResidualBlock,
    fit_to_points,
    weak_pull,
)
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.keypoints import GROSS_SIGMAS
from tracker.evidence.keypoints import PersonKeypoints
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.triangulation import sigma_px


@dataclass(frozen=True, eq=False)
class PersonObservations:
    """Observed points of one person."""

    names: tuple[str, ...]
    """Names of the body's points, (N,)."""
    joints_world: Array
    """Their positions in the world, (F, N, 3), metres; NaN where unknown."""
    seen: Array
    """Their positions in each view, (F, V, N, 2), in normalized image coordinates x / z; NaN where absent."""
    confidence: Array
    """(F, V, N), 0 to 1; 0 where absent."""

    def known_to(self, model: BodyModel) -> "PersonObservations":
        """Return those that are points of a body."""
        at = [i for i, n in enumerate(self.names) if n in model.point_names]
        names = tuple(self.names[i] for i in at)
        return PersonObservations(names, self.joints_world[:, at], self.seen[:, :, at], self.confidence[:, :, at])

    def places(self, frame: int) -> dict[str, Array]:
        """Return the points that are known on a frame by name, (3,) each, metres."""
        known = np.isfinite(self.joints_world[frame]).all(axis=1)
        return {n: p for n, p, k in zip(self.names, self.joints_world[frame], known, strict=True) if k}


_ROUNDS = 3
"""Fits to the key points, each with the offsets learnt from the one before."""


def fit_to_keypoints(
    model: BodyModel, seen: PersonObservations, frames: Sequence[int] | None = None
) -> dict[int, PosedBody]:
    """Fit a body to the triangulated points of each frame that has four or more, without looking at pictures.

    Args:
        model: the body; its sizes stay.
        seen: the points.
        frames: that are used, ascending; all by default.

    Returns:
        The body by frame.
    """
    points, out, near = _points(model, seen), dict[int, PosedBody](), None
    for k in range(len(seen.joints_world)) if frames is None else frames:
        if len(seen.places(k)) >= 4:
            near = fit_to_points(model, seen.places(k), near, centers=True, solver=solve_compiled_or_plain).pose
            out[k] = PosedBody(model, near)
    for _ in range(_ROUNDS - 1 if out else 0):
        offsets = learn_offsets(out, seen)
        out = {k: _refitted(b, points, seen.joints_world[k] - _turned(b, points, offsets)) for k, b in out.items()}
    return out


def _refitted(body: PosedBody, points: IntArray, targets_world: Array) -> PosedBody:
    """Return a body that is fitted to points from near, (N, 3), metres; NaN is ignored."""
    known = np.isfinite(targets_world).all(axis=1)
    weights = np.full(np.count_nonzero(known), 1 / OTHER_BODY_M)
    block = PointTargets(points[known], targets_world[known], weights, centers=True)
    blocks: list[ResidualBlock] = [block, PosePrior.of_spreads(body.model), weak_pull(body.model, body.values)]
    return PosedBody(body.model, solve_compiled_or_plain(body.model, body.values, blocks).pose)


def learn_offsets(bodies: Mapping[int, PosedBody], seen: PersonObservations) -> Array:
    """Return from each joint to its key point in the frame of the joint's proximal part, (N, 3), metres.

    It is the median over the frames, in which a detector is usually right; 0 for a point that is never known.

    Args:
        bodies: by frame, one at least.
        seen: the points.
    """
    model = next(iter(bodies.values())).model
    points, found = _points(model, seen), []
    for k, body in bodies.items():
        R = body.kinematics.Ts_world_part[model.proximal_parts[points], :3, :3]
        off = seen.joints_world[k] - body.joint_centers_world[points]
        found.append(np.einsum("nji,nj->ni", R, off))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nan_to_num(np.nanmedian(np.array(found), axis=0))


class DetectorModel(NamedTuple):
    """How a detector sees the body of a person."""

    names: tuple[str, ...]
    """Points of the body, (N,)."""
    offsets_part: Array
    """From each joint to its key point in the frame of the joint's proximal part, (N, 3), metres."""
    sigmas: Array
    """Standard deviation of each at confidence 1, (N,), in normalized image coordinates."""

    def keypoints(self, model: BodyModel, seen: PersonObservations, cameras: Sequence[Camera]) -> PersonKeypoints:
        """Return the key points of a recording as evidence for a body; the variance falls with the confidence.

        A point on whose place the views of a frame disagree is no more certain than they agree (R. T. Birge 1932).

        Args:
            model: the body.
            seen: the points on all frames.
            cameras: of the session, in its order; none: all points are as certain as their confidence says.
        """
        parts, places = _places(model, seen, self.offsets_part)
        sigmas = self.sigmas / np.sqrt(np.maximum(seen.confidence, TINY))
        apart = np.array([_errors(X, own, cameras) for X, own in zip(seen.joints_world, seen.seen, strict=True)])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # a point that no view shows
            usual = np.nanmedian((apart**2).sum(axis=-1), axis=1, keepdims=True)
        # The squared length of two normal coordinates has the median 2 ln 2.
        return PersonKeypoints(parts, places, seen.seen, np.fmax(sigmas, np.sqrt(usual / (2 * np.log(2)))))

    def costs(
        self, bodies: Mapping[int, PosedBody], seen: PersonObservations, cameras: Sequence[Camera]
    ) -> dict[int, float]:
        """Return by frame the robust cost of the key points, nats, in which one that is absent counts as grossly off.

        Args:
            bodies: by frame.
            seen: the points on all frames.
            cameras: of the session, in its order.
        """
        out = dict[int, float]()
        for k, body in bodies.items():
            parts, places = _places(body.model, seen, self.offsets_part)
            errors = _errors(_placed(body, parts, places), seen.seen[k], cameras) / self.sigmas[:, None]
            squares = np.nan_to_num(seen.confidence[k] * (errors**2).sum(axis=-1), nan=np.inf)
            out[k] = 0.5 * float(np.sum(GROSS_SIGMAS**2 / (1 + GROSS_SIGMAS**2 / np.maximum(squares, TINY))))
        return out


def learn_seen_body(
    bodies: Mapping[int, PosedBody], seen: PersonObservations, cameras: Sequence[Camera]
) -> DetectorModel:
    """Learn how a detector sees a body, from frames on which its pose is known.

    Args:
        bodies: by frame, one at least.
        seen: the points on all frames.
        cameras: of the session, in its order.
    """
    offsets = learn_offsets(bodies, seen)
    parts, places = _places(next(iter(bodies.values())).model, seen, offsets)
    errors = np.array([_errors(_placed(b, parts, places), seen.seen[k], cameras) for k, b in bodies.items()])
    errors *= np.sqrt(seen.confidence)[list(bodies), ..., None]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a point that is never seen has no errors
        sigmas = MAD_TO_SIGMA * np.nanmedian(np.abs(errors), axis=(0, 1, 3))
    least = min(sigma_px(c) / c.pinhole.K[0, 0] for c in cameras)
    return DetectorModel(seen.names, offsets, np.maximum(np.nan_to_num(sigmas), least))


def _places(model: BodyModel, seen: PersonObservations, offsets_part: Array) -> tuple[IntArray, Array]:
    """Return the proximal part of each key point, (N,), and its place there, (N, 3), metres."""
    points, neutral = _points(model, seen), PosedBody(model, model.neutral())
    parts = model.proximal_parts[points]
    T = neutral.kinematics.Ts_world_part[parts]
    joints = np.einsum("nji,nj->ni", T[:, :3, :3], neutral.joint_centers_world[points] - T[:, :3, 3])
    return parts, joints + offsets_part


def _placed(body: PosedBody, parts: IntArray, places: Array) -> Array:
    """Return places in parts of a body, (N, 3), in the world."""
    T = body.kinematics.Ts_world_part[parts]
    return np.einsum("nij,nj->ni", T[:, :3, :3], places) + T[:, :3, 3]


def _errors(points_world: Array, seen: Array, cameras: Sequence[Camera]) -> Array:
    """Return from points, (N, 3), to where views have them, (V, N, 2), in normalized image coordinates."""
    out = np.full(seen.shape, np.nan)
    for v, camera in enumerate(cameras):
        eye = rigid.apply(camera.T_camera_world, points_world)
        in_front = eye[:, 2] > NEAR_PLANE_M
        out[v, in_front] = seen[v, in_front] - eye[in_front, :2] / eye[in_front, 2:]
    return out


def _points(model: BodyModel, seen: PersonObservations) -> IntArray:
    return np.array([model.point_names.index(n) for n in seen.names], dtype=np.int64)


def _turned(body: PosedBody, points: IntArray, offsets: Array) -> Array:
    """Return offsets in the frames of the proximal parts, (N, 3), in the world."""
    R = body.kinematics.Ts_world_part[body.model.proximal_parts[points], :3, :3]
    return np.einsum("nij,nj->ni", R, offsets)
