"""The chamfer cost in the slow, obvious way, with numpy, OpenCV and SciPy: the oracle of the fast one.

It shares only the shapes' surface and implicit function with `tracker.evidence.contours.occluding_contours` and
`tracker.estimation.search.chamfer_cost`. A part is convex, so its outline is the convex hull of a dense mesh. Occlusion
of a point by another part is found by walking along the line of sight.
"""

from functools import lru_cache

import cv2
import numpy as np
from scipy.spatial import cKDTree

JOINT_MARGIN_M = 0.03
SAMPLE_PX = 1.5
STEP_M = 0.004


def visible_contour(model, values, camera):
    """Return points of the visible contour in undistorted px, (n, 2), spaced by about SAMPLE_PX, and the part of
    each."""
    Ts = model.kinematics(values).Ts_world_part
    outlines = [_outline(model, part, T, camera) for part, T in enumerate(Ts)]
    points, parts = [], []
    for part, (px, world) in enumerate(outlines):
        hidden = np.zeros(len(px), dtype=bool)
        for other, (other_px, _) in enumerate(outlines):
            if other == part or len(other_px) < 3:
                continue
            adjoin = model.parents[part] == other or model.parents[other] == part
            margin = JOINT_MARGIN_M if adjoin else 0.0
            covered = np.zeros(camera.size[::-1], np.uint8)  # generous by a pixel; the walk decides
            cv2.fillPoly(covered, [np.round(other_px).astype(np.int32)], 255)
            cv2.polylines(covered, [np.round(other_px).astype(np.int32)], True, 255, 3)
            u, v = np.round(px).astype(int).T
            inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
            near = ~inside
            near[inside] = covered[v[inside], u[inside]] > 0
            near &= ~hidden
            hidden[near] = _meets(model, other, Ts[other], camera.center_world, world[near], margin)
        points.append(px[~hidden])
        parts += [part] * int(np.sum(~hidden))
    return np.concatenate(points), np.array(parts)


def _outline(model, part, T, camera):
    """Closed outline of a part: px (n, 2) float32 in order, and the surface point of each, (n, 3)."""
    world = _surface(model, part) @ T[:3, :3].T + T[:3, 3]
    px = camera.project(world).astype(np.float32)
    if np.any(camera.depths(world) < 0.05):
        return np.empty((0, 2), np.float32), np.empty((0, 3))
    corners = cv2.convexHull(px, returnPoints=False)[:, 0]
    ring = np.append(corners, corners[0])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(px[ring], axis=0), axis=1))])
    at = np.arange(0.0, lengths[-1], SAMPLE_PX)
    even = [np.stack([np.interp(at, lengths, c) for c in points[ring].T], axis=1) for points in (px, world)]
    return even[0].astype(np.float32), even[1]


@lru_cache(maxsize=64)
def _surface(model, part):
    """The mesh of a part in its own frame, (n, 3): the same in each pose."""
    return model.shapes[part].grid(80, 120)[0].reshape(-1, 3) + model.centers_part[part]


def _meets(model, part, T, eye, points, margin_m):
    """Return whether the lines of sight to points meet a part before the point, or less than the margin behind it,
    (n,)."""
    to_points = points - eye
    distances = np.linalg.norm(to_points, axis=1)[:, None]
    center = T[:3, 3] + T[:3, :3] @ model.centers_part[part]
    reach = max(model.shapes[part].half_axes) * 1.5
    middle = np.linalg.norm(center - eye)
    along = np.arange(middle - reach, middle + reach, STEP_M)[None]
    line = eye + along[..., None] * (to_points / distances)[:, None]
    local = (line - T[:3, 3]) @ T[:3, :3] - model.centers_part[part]
    return np.any((model.shapes[part].inside_outside(local) < 1.0) & (along < distances + margin_m), axis=1)


def cost(model, values, views, scene_points, theta_px):
    """Undirected chamfer distance, mean over the views, px; directed ones (V, 2) too.

    Args:
        views: `ViewEvidence` of each view at scale 1.
        scene_points: edge points of each view that count, (n, 2).
        theta_px: distance at which every point is cut off.
    """
    directed = []
    for view, scene in zip(views, scene_points, strict=True):
        contour, _ = visible_contour(model, values, view.camera)
        if not len(contour):
            directed.append((theta_px, theta_px))
            continue
        size = np.array(view.camera.size)
        inside = np.clip(contour, 0, size - 1).astype(np.float32)
        sampled = cv2.remap(view.distance, inside[None], None, cv2.INTER_LINEAR)[0]
        forward = sampled + np.linalg.norm(contour - inside, axis=1)
        backward = cKDTree(contour).query(scene)[0] if len(scene) else np.array([theta_px])
        directed.append((np.minimum(forward, theta_px).mean(), np.minimum(backward, theta_px).mean()))
    return float(np.mean(directed)), np.array(directed)
