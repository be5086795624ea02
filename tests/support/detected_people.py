"""Key points of several people as a detector finds them, with noise, offsets, gross errors and occlusions."""

import cv2
import numpy as np
from filmed_people import NAMES, dancing
from observed_people import BODY_25

from tracker.formats.model_toml import load_model
from tracker.formats.trc import read_trc
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of

_OF_TRC = {"Neck": "Neck"} | {
    f"{side[0]}{own}": f"{side}{theirs}"
    for side in ("Left", "Right")
    for own, theirs in (("Shoulder", "Arm"), ("Elbow", "ForeArm"), ("Wrist", "Hand"), ("Hip", "UpLeg"),
                        ("Knee", "Leg"), ("Ankle", "Foot"), ("BigToe", "ToeBase"))
}  # fmt: skip
"""Marker of `two_people` for a point of BODY_25."""


def acted(scene, n_frames, seed=0, fps=25.0, person=""):
    """Joints of the people of a scene, (F, P, 25, 3), metres, NaN for points that bodies lack; heights by name."""
    cast = cast_of(scene, seed, person)
    out = np.full((n_frames, len(cast), len(BODY_25.points), 3), np.nan)
    of = BODY_25.counterparts(BODY_25.points)
    for p, role in enumerate(cast):
        model = load_model("gavrila22", role.height_m)
        points = np.stack([model.points_world(pose) for pose in solve_posture(role, model, n_frames, fps)])
        for i, name in enumerate(BODY_25.points):
            if len(of[name]) == 1 and of[name][0] in model.point_names:
                out[:, p, i] = points[:, model.point_names.index(of[name][0])]
    return out, {role.name: role.height_m for role in cast}


def danced(n_frames, n_people=2):
    """Joints of people who dance at random around one place, as of `acted`."""
    out = np.full((n_frames, n_people, len(BODY_25.points), 3), np.nan)
    at = [BODY_25.points.index(name) for name in NAMES]
    for p in range(n_people):
        out[:, p, at] = np.roll(dancing(n_frames, seed=p), p * n_frames // n_people, axis=0)
    return out


def filmed_couple(folder):
    """Reference joints of `two_people`, as of `acted`."""
    tables = [read_trc(folder / f"ground_truth_person{p}.trc") for p in (1, 2)]
    out = np.full((len(tables[0].points), 2, len(BODY_25.points), 3), np.nan)
    for p, table in enumerate(tables):
        for name, marker in _OF_TRC.items():
            out[:, p, BODY_25.points.index(name)] = table.points[:, table.names.index(marker)]
    return out


def detected(cameras, joints, seed=0, sigma_px=2.0, offset_px=3.0, gross=0.04, alone=0, tracks=None):
    """Key points of people in all cameras, in random order in each picture.

    Args:
        cameras: which film them.
        joints: (F, P, N, 3), metres; NaN for points that no detector finds.
        seed: of all that is random.
        sigma_px: noise of each point.
        offset_px: standard deviation of an offset of each joint of each person, the same in all pictures.
        gross: share of points that are 60 px off.
        alone: number of frames on which the first person is alone.
        tracks: names of the people in the files of each camera, (V, P); None for files without names.
    """
    random = np.random.default_rng((seed, 11))
    n_frames, n_people, n_points = joints.shape[:3]
    offsets = offset_px * random.normal(size=(n_people, n_points, 2))
    px = np.full((n_frames, len(cameras), n_people, n_points, 2), np.nan)
    known = np.zeros(px.shape[:-1], dtype=bool)
    for v, camera in enumerate(cameras):
        true = camera.project(joints.reshape(-1, 3)).reshape(*joints.shape[:3], 2)
        inside = np.all((true > 0) & (true < np.array(camera.size)), axis=-1)
        known[:, v] = inside & ~_hidden(camera, joints, true, random)
        px[:, v] = true + offsets + sigma_px * random.normal(size=true.shape)
    wrong = random.random(known.shape) < gross
    px[wrong] += 60 * random.normal(size=(int(wrong.sum()), 2))
    known[:alone, :, 1:] = False
    order = np.argsort(random.random((*known.shape[:2], n_people)), axis=2)
    px, known = (np.take_along_axis(a, order.reshape(*order.shape, *[1] * (a.ndim - 3)), axis=2) for a in (px, known))
    named = None
    if tracks is not None:
        named = np.where(known.any(axis=-1), np.array(tracks)[np.arange(len(cameras))[:, None], order], "")
    points = ObservedPoints(
        BODY_25.points, tuple(c.name for c in cameras), np.where(known[..., None], px, np.nan), 0.9 * known, named
    )
    return ObservationSet("people", "openpose", ("person",), BODY_25, points, None, (np.arange(float(n_frames)),))


def _hidden(camera, joints, true_px, random):
    """Most joints of a person whom somebody nearer hides, and a tenth of all others, (F, P, N)."""
    depths = np.nanmedian((joints - camera.center_world) @ camera.T_world_camera[:3, 2], axis=2)
    out = random.random(true_px.shape[:3]) < 0.1
    for k, p in np.ndindex(depths.shape):
        for q in np.flatnonzero(depths[k] < depths[k, p]):
            hull = cv2.convexHull(true_px[k, q][np.isfinite(true_px[k, q, :, 0])].astype(np.float32))
            for i in np.flatnonzero(np.isfinite(true_px[k, p, :, 0])):
                if cv2.pointPolygonTest(hull, tuple(true_px[k, p, i].tolist()), False) > 0 and random.random() < 0.8:
                    out[k, p, i] = True
    return out
