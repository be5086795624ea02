"""A person who walks and dances before cameras, as key points with noise, gross errors, and a known truth."""

import numpy as np
import rigs
from observed_people import BODY_25

from tracker.body.model import BodyModel
from tracker.calibration.boards.rig_fit import blank_camera
from tracker.formats.model_toml import load_model
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints

FOCAL_PX, SIZE = 500.0, (640, 480)
STATURE_M = 1.70
_LIVELY = {f"{side}_{part}": share for side in ("left", "right") for part, share in
           (("shoulder", 1.0), ("elbow", 1.0), ("hip", 0.3), ("knee", 0.3))}  # fmt: skip
"""Joints that move, and how much: the trunk stays upright."""
NAMES = tuple(p for p in BODY_25.points if len(BODY_25.counterparts(BODY_25.points)[p]) == 1)


def dancing(n_frames, seed=0, reach=1.0, bend=0.5, model: BodyModel | None = None):
    """Points of a person who moves at random, feet on the ground, (n_frames, n_points, 3), metres."""
    model, random = model or load_model("gavrila38", STATURE_M), np.random.default_rng(seed)
    at = [model.point_names.index(BODY_25.counterparts(NAMES)[n][0]) for n in NAMES]
    out = []
    for k in range(n_frames):
        angle = 2 * np.pi * k / n_frames
        step = bend * random.normal(size=model.n_dofs) * [_LIVELY.get(n.split(".")[0], 0.0) for n in model.dof_names]
        pose = model.retract(model.neutral(), step)
        points = model.points_world(pose)[at]
        c, s = np.cos(2 * angle), np.sin(2 * angle)
        upright = points - model.points_world(pose)[0]
        turned = upright @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        place = reach * np.array([np.cos(angle), np.sin(angle), 0.0])
        out.append(turned + place - [0, 0, turned[:, 2].min()])
    return np.stack(out)


def rig(n=4, arc=2 * np.pi):
    """Cameras of one lens on a circle, or on a part of it."""
    return rigs.cameras(rigs.ring(n, arc=arc), np.zeros(5), SIZE)


def blanks(cameras):
    """The same cameras with nothing known but the size of the pictures."""
    return [blank_camera(c.name, c.size) for c in cameras]


def observed(cameras, points, sigma_px=3.0, gross=0.05, seed=0, crowd=()):
    """Key points of a person in all cameras; a share is grossly wrong. Cameras of a `crowd` show somebody else, too."""
    random = np.random.default_rng((seed, 7))
    n_frames, n_points = points.shape[:2]
    px = np.stack([c.project(points.reshape(-1, 3)).reshape(n_frames, n_points, 2) for c in cameras], axis=1)
    px = px + sigma_px * random.normal(size=px.shape)
    wrong = random.random(px.shape[:3]) < gross
    px[wrong] += 60 * random.normal(size=(int(wrong.sum()), 2))
    inside = np.all((px > 0) & (px < np.array(SIZE)), axis=-1)
    px = np.where(inside[..., None], px, np.nan)[:, :, None]
    confidence = np.where(inside, 0.9, 0.0)[:, :, None]
    if len(crowd):
        others, known = np.full(px.shape, np.nan), np.zeros(confidence.shape)
        others[:, crowd], known[:, crowd] = px[:, crowd] + 30, confidence[:, crowd]
        px, confidence = np.concatenate([px, others], axis=2), np.concatenate([confidence, known], axis=2)
    names = tuple(c.name for c in cameras)
    return ObservationSet(
        "person", "openpose", ("person",), BODY_25, ObservedPoints(NAMES, names, px, confidence), None,
        np.arange(float(n_frames)),
    )  # fmt: skip


def aligned(found, true):
    """The best similarity: scale, rotation and translation from found points to true ones, (n, 3)."""
    a, b = found.mean(axis=0), true.mean(axis=0)
    U, S, Vt = np.linalg.svd((true - b).T @ (found - a))
    D = np.diag([1, 1, np.linalg.det(U @ Vt)])
    scale = float(np.trace(np.diag(S) @ D) / np.sum((found - a) ** 2))
    R = U @ D @ Vt
    return scale, R, b - scale * R @ a


def joint_errors_m(found, true_points, frames=slice(None)):
    """Scale from found to true joints, and the error of each after the best similarity, metres."""
    joints = found.world.joints_world.reshape(-1, 3)
    true = true_points[frames].reshape(-1, 3)
    known = np.isfinite(joints).all(axis=1)
    # Gross errors of two views move joints; the best half of them shows the cameras.
    joints, true = joints[known], true[known]
    chosen = np.arange(len(joints))
    for _ in range(4):
        scale, R, t = aligned(joints[chosen], true[chosen])
        errors = np.linalg.norm(scale * joints @ R.T + t - true, axis=1)
        chosen = np.argsort(errors)[: int(0.9 * len(errors))]
    return scale, errors, R
