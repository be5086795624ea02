"""Sessions without footage, people whose points are known, and the files in which other programs write them."""

import json

import numpy as np
from rigs import cameras, ring

from tracker.evaluation.references import read_joints
from tracker.footage.camera_source import CameraSource
from tracker.formats.joint_maps import known_joint_maps
from tracker.formats.model_toml import load_model
from tracker.session.session import Person, create_session

FPS = 30.0
BODY_25 = next(m for m in known_joint_maps() if m.name == "BODY_25")
_OTHERS = {"Nose": (0.1, 0, 1.6), "REye": (0.1, -0.03, 1.63), "LEye": (0.1, 0.03, 1.63), "REar": (0, -0.08, 1.6),
           "LEar": (0, 0.08, 1.6), "LSmallToe": (0.16, 0.15, 0.03), "RSmallToe": (0.16, -0.15, 0.03)}  # fmt: skip
STANDING = {
    "shoulder": (0.0, 0.2, 1.4), "elbow": (0.0, 0.28, 1.12), "wrist": (0.05, 0.3, 0.87), "hip": (0.0, 0.11, 0.93),
    "knee": (0.02, 0.11, 0.5), "ankle": (0.0, 0.11, 0.08), "heel": (-0.05, 0.11, 0.03), "toe": (0.18, 0.1, 0.03),
}  # fmt: skip


def standing_points(names=BODY_25.points):
    """Points of a standing person who looks along x, (n_points, 3), metres."""
    own = {"neck": np.array([0.0, 0.0, 1.45]), "head": np.array([0.0, 0.0, 1.65])}
    for joint, (x, y, z) in STANDING.items():
        own |= {f"left_{joint}": np.array([x, y, z]), f"right_{joint}": np.array([x, -y, z])}
    where = BODY_25.counterparts(names)
    return np.array([np.mean([own[p] for p in where[n]], axis=0) if where[n] else _OTHERS[n] for n in names])


def walking(n_frames, start=(-0.5, 0.0, 0.0), step=(0.03, 0.01, 0.0), names=BODY_25.points):
    """Points of a person who walks with swinging limbs, (n_frames, n_points, 3), metres."""
    points = standing_points(names)
    out = np.repeat(points[None], n_frames, axis=0)
    for k in range(n_frames):
        swing = np.sin(0.3 * k) * 0.35 * np.abs(points[:, 2] - 1.0) * np.sign(points[:, 1])
        out[k, :, 0] += np.where(points[:, 2] < 1.3, swing, 0.0)
        out[k] += np.array(start) + k * np.array(step)
    return out


def true_motion(session):
    """Points of the person whom the sample shows, (n_frames, n_points, 3), metres; NaN where they are unknown."""
    truth = read_joints(session.folder / "truth.trc", session.fps)
    out = np.full((session.n_frames, len(BODY_25.points), 3), np.nan)
    for point, marker in BODY_25.markers.items():
        if point in truth.names and marker in BODY_25.points:  # others are means of two
            out[:, BODY_25.points.index(marker)] = truth.points[: session.n_frames, truth.names.index(point)]
    return out


def make_session(
    folder, n_frames, n_views=4, people=("ann",), distortion=(-0.3, 0.1, 0.001, 0.0), offsets=(), size=(640, 480)
):
    """A session whose footage does not exist."""
    sources = [
        CameraSource(c, folder.parent / f"{c.name}.mp4", offset=dict(offsets).get(c.name, 0))
        for c in cameras(ring(n_views), distortion, size)
    ]
    model = load_model("gavrila38", 1.7)
    persons = [Person(name, model, "#53a504") for name in people]
    return create_session(folder, cameras=sources, people=persons, fps=FPS, n_frames=n_frames)


def seen(session, motions, noise_px=0.0, seed=0):
    """x, y, confidence of the points of people in each view, (n_frames, n_views, n_people, n_points, 3)."""
    rng = np.random.default_rng(seed)
    out = np.empty((len(motions[0]), len(session.cameras), len(motions), motions[0].shape[1], 3))
    for v, source in enumerate(session.cameras):
        for p, motion in enumerate(motions):
            out[:, v, p, :, :2] = source.camera.project(motion)
    out[..., :2] += noise_px * rng.normal(size=out[..., :2].shape)
    out[..., 2] = 0.9
    return out


def write_openpose(folder, names, points, first=0):
    """One folder for each camera; absent points are 0, 0, 0, absent people are left out."""
    for v, name in enumerate(names):
        (folder / name).mkdir(parents=True)
        for k, people in enumerate(points[:, v]):
            rows = [np.where(np.isfinite(p[:, :1]), p, 0.0).round(3).ravel().tolist() for p in people]
            present = [{"person_id": [-1], "pose_keypoints_2d": row} for row in rows if any(row)]
            path = folder / name / f"{name}_{first + k:012d}_keypoints.json"
            path.write_text(json.dumps({"version": 1.3, "people": present}))
    return folder
