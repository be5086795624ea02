"""Staged scenes with known truth: cameras around a point, simple bodies, edges drawn from contours."""

from dataclasses import replace

import cv2
import numpy as np
from scipy.spatial import cKDTree

from tracker.body.model import PosedBody
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.edge_segments import link_edges
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import RegionFeatures, select_evidence
from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import parse_model
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation

SIZE = (640, 480)


def camera_at(name, center_world, target_world=(0.0, 0.0, 0.0), size=SIZE, focal=520.0):
    """A pinhole camera that looks at a target; world z appears upwards."""
    center_world, target_world = np.array(center_world, dtype=float), np.array(target_world, dtype=float)
    z = (target_world - center_world) / np.linalg.norm(target_world - center_world)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), center_world
    K = np.array([[focal, 0.0, (size[0] - 1) / 2], [0.0, focal, (size[1] - 1) / 2], [0.0, 0.0, 1.0]])
    return Camera(name, size, K, np.zeros(0), T)


def cameras_around(n=3, radius_m=4.0, height_m=0.6, size=SIZE):
    """Cameras on a circle about the origin, looking at it; evenly spread, none opposite another for odd n."""
    turns = 2 * np.pi * np.arange(n) / n + 0.3
    return [camera_at(f"cam{i}", (radius_m * np.cos(a), radius_m * np.sin(a), height_m), size=size)
            for i, a in enumerate(turns)]  # fmt: skip


def solid(half_axes, exponents=(1, 1), name="solid"):
    """A body of one free part, sizes in metres, whose values are x, y, z and three turns about x, y, z."""
    return parse_model(
        f"""
        version = 1
        name = "{name}"
        height_m = 1.0
        parts = [{{ name = "solid", half_axes = {[float(a) for a in half_axes]}, exponents = {list(exponents)} }}]
        [[joints]]
        name = "root"
        child = "solid"
        free = true
        axes = [{{ name = "a", axis = [1, 0, 0] }}, {{ name = "b", axis = [0, 1, 0] }}, {{ name = "c", axis = [0, 0, 1] }}]
        [[search]]
        name = "place"
        dofs = ["root.x", "root.y", "root.z"]
        """,  # noqa: E501
        name,
    )


def at(model, *place, turns=(0.0, 0.0, 0.0)):
    """A solid placed in the world."""
    return PosedBody(model, np.array([*place, *turns], dtype=float))


def edge_map(bodies, camera):
    """The visible contours of bodies as edges, one pixel thin, (H, W) bool."""
    seen = occluding_contours.trace(bodies, camera)
    image = np.zeros((camera.height, camera.width), np.uint8)
    # Without the shift cv2.line would round the ends: half a pixel is much for what is measured here.
    ends = np.round(seen.pieces_px[~seen.occluded] * 16).astype(int)
    for x0, y0, x1, y1 in ends:
        cv2.line(image, (x0, y0), (x1, y1), 255, shift=4)
    return image > 0


def view_evidence(
    camera, edge_map, gradients=None, corner_px=(0, 0), image_size=None, predicted_px=None, static_edges=None
):
    """Evidence at scale 1 from an edge map, (H, W); without gradients, (2, H, W), edges have no directions."""
    found = edge_map.view(np.uint8)
    segments = None if gradients is None else link_edges(found, gradients)
    features = RegionFeatures(camera, 1.0, corner_px, image_size, found, segments)
    return select_evidence(features, predicted_px, static_edges)


def own_evidence(bodies, cameras):
    """Evidence that shows the visible contours of bodies and nothing else; edges run as the contours do."""
    return tuple(_across(view_evidence(c, edge_map(bodies, c)), bodies) for c in cameras)


def _across(view, bodies):
    """The same view, the normal of each edge point across the piece of contour that it was drawn from."""
    seen = occluding_contours.trace(bodies, view.camera)
    pieces = seen.pieces_px[~seen.occluded]
    if not len(pieces) or not len(view.points_px):
        return view
    steps = pieces[:, 2:] - pieces[:, :2]
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.maximum(np.linalg.norm(steps, axis=1), 1e-6)[:, None]
    nearest = cKDTree((pieces[:, :2] + pieces[:, 2:]) / 2).query(view.points_px)[1]
    return replace(view, normals=normals[nearest].astype(np.float32))


def painted(bodies, camera, colors, background=(40, 90, 60)):
    """Return an image of bodies in flat colours, (H, W, 3) RGB: far parts first, each the hull of its mesh.

    Args:
        bodies: all bodies.
        camera: the view.
        colors: RGB of each part by its name, without `left_` and `right_`.
        background: RGB of the rest.
    """
    image = np.full((camera.height, camera.width, 3), background, np.uint8)
    parts = []
    for body in bodies:
        Ts = body.model.kinematics(body.values).Ts_world_part
        for part, shape, center, T in zip(
            body.model.parts, body.model.shapes, body.model.centers_part, Ts, strict=True
        ):
            world = (shape.grid(20, 30)[0].reshape(-1, 3) + center) @ T[:3, :3].T + T[:3, 3]
            color = colors[part.name.removeprefix("left_").removeprefix("right_")]
            parts.append((camera.depths(world).mean(), camera.project(world), color))
    for _, px, color in sorted(parts, key=lambda p: -p[0]):
        cv2.fillConvexPoly(image, cv2.convexHull(np.round(px).astype(np.int32)), color)
    return image


def dressed(bodies, cameras, colors):
    """Evidence of the bodies' own contours and colours."""
    views = own_evidence(bodies, cameras)
    return tuple(replace(v, colors=painted(bodies, v.camera, colors)) for v in views)


SUIT = {
    "torso": (200, 40, 40), "abdomen": (200, 40, 40), "pelvis": (200, 40, 40), "head": (230, 190, 160),
    "collar": (200, 40, 40), "upper_arm": (250, 250, 240), "forearm": (220, 160, 130), "thigh": (30, 40, 140),
    "calf": (20, 20, 25),
}  # fmt: skip
"""Colours that distinguish all kinds of parts."""


class Film:
    """A recording of figures in their clothes before a plain wall."""

    def __init__(self, moments, cameras):
        self.frames = [[painted(bodies, c, SUIT) for c in cameras] for bodies in moments]

    def read(self, k):
        return self.frames[k]


def filmed(moments):
    """Observer of a film; `moments` holds the bodies of each frame."""
    cameras = cameras_around(4)
    return Observer([CameraSource(c, footage=None) for c in cameras], Film(moments, cameras))


def shaken(model, values, rng, sigma_rad, sigma_m):
    """A pose displaced at random in all degrees of freedom, within the joint limits."""
    sigma = np.where(model.dof_is_length, sigma_m, sigma_rad)
    return model.clip(model.retract(values, sigma * rng.normal(size=model.n_dofs)))


POSTURE_DEG = {
    "left_shoulder.abduction": 50, "left_elbow.extension": 50, "right_shoulder.elevation": 60,
    "right_elbow.extension": 70, "left_hip.elevation": 40, "left_hip.flexion": 40, "left_knee.extension": 60,
    "right_hip.abduction": 15, "right_knee.extension": 20,
}  # fmt: skip
"""Limbs away from the trunk and bent, so that each view shows most of them. A hip that flexes has no elevation."""


def in_posture(model):
    """A body in the posture, as far as it has these joints."""
    values = model.neutral()
    for name, degrees in POSTURE_DEG.items():
        if name in model.dof_names:
            values[model.dof_value[model.dof_names.index(name)]] = np.radians(degrees)
    return values


def posed(model, seed):
    """A body in the posture, slightly different for each seed; models without these joints are only shaken."""
    return shaken(model, in_posture(model), np.random.default_rng(seed), 0.1, 0.05)


class Shown:
    """An observer with given evidence for each frame; it records which frames are requested."""

    def __init__(self, views):
        self.views, self.asked = views, []
        self.working_cameras = [v.camera for v in views[0]]

    def ahead_frames(self, k):
        return (0.0,) * len(self.working_cameras)

    def prefetch(self, k, regions=None, with_static_edges=False, edges=None):
        pass

    def evidence(self, k, regions, outlines=None, static_edges=None, edges=None):
        assert len(regions) == len(self.working_cameras)
        self.asked.append(k)
        return self.views[k]


def seen(model, values, names, cameras, noise_px=0.0, seed=0):
    """Pins of points in all views, with the noise of a user's hand."""
    rng = np.random.default_rng(seed)
    places = model.named_points_world(values)
    return [
        PointObservation(name, i, tuple(camera.pinhole.project(places[name]) + rng.normal(0, noise_px, 2)))
        for name in names
        for i, camera in enumerate(cameras)
    ]
