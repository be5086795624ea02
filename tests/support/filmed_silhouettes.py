"""Silhouettes of simulated people who walk round as they move, in exact masks or those of a program."""

from typing import NamedTuple

import cv2
import numpy as np

from tracker.calibration.self_calibration.person_silhouettes import measure_silhouette
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin
from tracker.simulate.record import PRESET
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.rasterizer import SAMPLES, covered, pixel_means

SIZE, FPS = (640, 480), 3.0
WAY_M = 0.9
"""Radius of the circle that a person walks along once."""


class Segmentation(NamedTuple):
    """Errors of masks."""

    noise_px: float = 0.0
    """Standard deviation of the border, alike over some 5 px."""
    holes: int = 0
    """Number of round holes in a mask, of 2 to 6 px radius."""
    dilation_px: float = 0.0
    """Distance by which each border lies outside of the true one."""


EXACT = Segmentation()


class FilmedSilhouettes(NamedTuple):
    """Silhouettes of one person before cameras."""

    cameras: tuple
    rows: list
    """By frame and camera."""
    joints_world: np.ndarray
    """(F, N, 3), metres."""
    height_m: float


def filmed(person, scene, seed, n_cameras, n_frames, segmentations=(EXACT,)):
    """Film a person and return the silhouettes by each segmentation.

    Cameras are the first of those in the four corners, with lenses that distort a little.
    """
    cameras = make_cameras(4, SIZE, seed)[:n_cameras]
    (role,) = cast_of(scene, seed, person)
    model = altered_model(load_model(PRESET, role.height_m), role.build.bone_factors)
    skin, poses = make_skin(model, role.outfit, role.build), solve_posture(role, model, n_frames, FPS)
    rows, joints = [[] for _ in segmentations], []
    random = np.random.default_rng([seed, 17])
    for k, pose in enumerate(poses):
        angle = 2 * np.pi * k / n_frames
        place = WAY_M * np.array([np.cos(angle), np.sin(angle), 0.0])
        way = rigid.transform(rigid.so3_exp(np.array([0.0, 0.0, angle])), place)
        joints.append(rigid.apply(way, model.points_world(pose)))
        vertices = rigid.apply(way, skin.posed(pose))
        masks = [_mask(c, vertices, skin.faces) for c in cameras]
        for out, segmentation in zip(rows, segmentations, strict=True):
            found = [segmented(m, segmentation, random) for m in masks]
            out.append([measure_silhouette(m, c.undistort_points) for m, c in zip(found, cameras, strict=True)])
    return [FilmedSilhouettes(cameras, r, np.stack(joints), role.height_m) for r in rows]


def segmented(mask, segmentation, random):
    """A mask with errors; the exact one without."""
    if segmentation == EXACT:
        return mask
    inside, outside = (cv2.distanceTransform(m.astype(np.uint8), cv2.DIST_L2, 5) for m in (mask, ~mask))
    depth = np.where(mask, inside - 0.5, 0.5 - outside) + segmentation.dilation_px
    noise = cv2.GaussianBlur(random.normal(size=mask.shape), (0, 0), 5 / 2)
    out = depth + segmentation.noise_px * noise / noise.std() > 0
    rows, columns = np.nonzero(mask)
    for i in random.integers(len(rows), size=segmentation.holes if len(rows) else 0):
        cv2.circle(hole := np.zeros(mask.shape, np.uint8), (columns[i], rows[i]), int(random.integers(2, 7)), 1, -1)
        out &= hole == 0
    return out


def _mask(camera, vertices, faces):
    """The pixels of which a body covers half."""
    finer = camera.scaled(SAMPLES)
    px = np.nan_to_num(finer.project(vertices))
    samples = covered(px, faces, finer.size)
    return pixel_means(samples.astype(np.float32)) >= 0.5
