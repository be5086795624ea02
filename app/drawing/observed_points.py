"""Draw imported points over the pictures, limbs of them that are off, and the outlines of masks to import."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

import cv2
import numpy as np

from tracker.errors import TrackerError
from tracker.evaluation.judging.judge import Judgement
from tracker.evaluation.judging.verdicts import LIMBS
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.plans import MaskPlan

_CROSS = 0.004
"""Half the size of the cross of a point, as a share of the longer side of the picture."""
_CHAINS = (*LIMBS.values(), ("left_shoulder", "right_shoulder", "right_hip", "left_hip", "left_shoulder"))
"""Points of the body that lines join."""


def observed_segments(found: ObservationSet, camera: Camera, view: int, frame: int) -> FloatArray:
    """Return crosses at the points of all people in a view, and lines between their joints, (N, 4), undistorted px.

    Args:
        found: the observations; key points are drawn as they are, joints in space are projected.
        camera: of the view.
        view: its index.
        frame: the frame.
    """
    if found.points is not None:
        points = np.where(found.points.is_known[frame, view, :, :, None], found.points.points_px[frame, view], np.nan)
        px = camera.undistort_points(points.reshape(-1, 2)).reshape(points.shape)
    else:
        assert found.joints is not None
        joints = found.joints.joints_world[frame]
        px = camera.pinhole.project(joints.reshape(-1, 3)).reshape(*joints.shape[:2], 2)
    columns = {names[0]: i for i, names in enumerate(found.counterparts.values()) if len(names) == 1}
    return _joined([{n: own[i] for n, i in columns.items()} for own in px], list(px), camera)


def mask_outlines(plan: MaskPlan, camera: Camera, picture: int) -> FloatArray:
    """Return the outlines of people in a mask that is previewed, (N, 4), undistorted px; none where it cannot be read.

    Args:
        plan: the import.
        camera: of the view.
        picture: number of the picture in the footage.
    """
    places = np.flatnonzero(plan.pictures.get(camera.name, np.empty(0)) == picture)
    lines = [np.empty((0, 4))]
    if len(places):
        with suppress(TrackerError):
            mask = plan.mask(camera.name, int(places[0]), camera.size)
            outlines, _ = cv2.findContours((mask > 0).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
            ends = [camera.undistort_points(outline[:, 0].astype(np.float64)) for outline in outlines]
            lines += [np.hstack([px, np.roll(px, -1, axis=0)]) for px in ends]
    return np.concatenate(lines).astype(np.float32)


def limbs_off(judgements: Sequence[Judgement], camera: Camera, frame: int) -> FloatArray:
    """Return the imported limbs that are off on a frame as crosses and lines, (N, 4), undistorted px."""
    people = list[dict[str, Array]]()
    for judgement in judgements:
        places = judgement.imported.places(frame)
        for limb, verdict in judgement.frames.get(frame, {}).items():
            known = [j for j in LIMBS[limb] if j in places]
            if verdict.is_doubted and known:
                px = camera.pinhole.project(np.array([places[j] for j in known]))
                people.append(dict(zip(known, px, strict=True)))
    return _joined(people, [np.array([*own.values()]) for own in people], camera)


def _joined(people: Sequence[dict[str, Array]], points: Sequence[Array], camera: Camera) -> FloatArray:
    """Return crosses at points and lines between joints of people, by name; absent points are left out."""
    size = _CROSS * max(camera.size)
    arms = np.array([[-size, 0.0, size, 0.0], [0.0, -size, 0.0, size]])
    out = [(np.tile(own, 2)[:, None] + arms).reshape(-1, 4) for own in points]
    for own in people:
        pairs = [(a, b) for chain in _CHAINS for a, b in pairwise(chain)]
        out += [np.concatenate([own[a], own[b]])[None] for a, b in pairs if a in own and b in own]
    lines = np.concatenate(out) if out else np.empty((0, 4))
    return lines[np.isfinite(lines).all(axis=1)].astype(np.float32)
