"""A small z-buffer renderer: triangles into samples, samples into antialiased pixels."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

SAMPLES = 2
"""Samples per pixel along each axis. The colour of a pixel is the mean over its area, which is centred at integers."""

AMBIENT_SKY = 0.52
AMBIENT_GROUND = 0.36
DIRECT = 0.55


class Figure(Protocol):
    """A mesh that follows a pose and has colours, and can be rendered."""

    @property
    def faces(self) -> IntArray:
        """Triangles, counter-clockwise seen from outside, (M, 3)."""

    def posed(self, values: Array) -> Array:
        """Return the vertices in a pose, (N, 3), metres, world."""

    def colors(self, faces: IntArray, corner_weights: Array) -> Array:
        """Return colours, (n, 3), 0 to 1, at points on triangles `(n,)` with barycentric weights `(n, 3)`."""


class Hits(NamedTuple):
    """The surface point seen by each sample of an image."""

    faces: NDArray[np.int32]
    """Index of the nearest triangle, -1 for none, (H, W)."""
    inverse_depths: NDArray[np.float32]
    """1 / depth along the optical axis, (H, W), 1/m; 0 at infinity."""
    weights: NDArray[np.float32]
    """Barycentric weights on the triangle, perspective-correct, (H, W, 3)."""


def cast(
    camera: Camera, vertices_world: Array, faces: IntArray, inverse_depths: NDArray[np.float32] | None = None
) -> Hits:
    """Find the nearest triangle at each pixel centre of a camera.

    Triangles should be small where the lens distorts: their corners are distorted, their edges stay straight.

    Args:
        camera: the camera, as large as the image of samples.
        vertices_world: (N, 3), metres.
        faces: (M, 3).
        inverse_depths: other surfaces, as in `Hits`; by default none.
    """
    shape = (camera.height, camera.width)
    found = np.zeros(shape, dtype=np.float32) if inverse_depths is None else inverse_depths.copy()
    hits = Hits(np.full(shape, -1, dtype=np.int32), found, np.zeros((*shape, 3), dtype=np.float32))
    depths = camera.depths(vertices_world)
    inverse = np.where(depths > NEAR_PLANE_M, 1.0 / np.maximum(depths, NEAR_PLANE_M), -1.0)
    _rasterize(np.nan_to_num(camera.project(vertices_world)), inverse, faces, *hits)
    return hits


def covered(points_px: Array, faces: IntArray, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the pixels, (H, W), whose centres lie within the triangles of plane points (N, 2)."""
    shape = (size[1], size[0])
    hits = Hits(
        np.full(shape, -1, dtype=np.int32), np.zeros(shape, dtype=np.float32), np.zeros((*shape, 3), dtype=np.float32)
    )
    _rasterize(points_px, np.ones(len(points_px)), faces, *hits)
    return hits.faces >= 0


def vertex_normals(vertices: Array, faces: IntArray) -> Array:
    """Return outward unit normals of a mesh's vertices, weighted by the area of the triangles around, (N, 3)."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    columns = [np.bincount(faces.ravel(), np.repeat(across[:, i], 3), len(vertices)) for i in range(3)]
    normals = np.stack(columns, axis=1)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def lit(colors: Array, normals: Array, points_world: Array, light_world: Array) -> Array:
    """Shade surface colours (n, 3): light from the ceiling lamp, and from a bright ceiling and a darker floor."""
    to_light = light_world - points_world
    to_light /= np.linalg.norm(to_light, axis=1, keepdims=True)
    facing = np.sum(normals * to_light, axis=1)
    # The light extends a little past the terminator, as under a lamp of some size.
    direct = np.clip((facing + 0.2) / 1.2, 0.0, None)
    up = 0.5 + 0.5 * normals[:, 2]
    return colors * (AMBIENT_GROUND + (AMBIENT_SKY - AMBIENT_GROUND) * up + DIRECT * direct)[:, None]


def pixel_means(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average the samples of each pixel, `(SAMPLES * H, SAMPLES * W, ...)` to `(H, W, ...)`."""
    n = SAMPLES
    total = sum(samples[i::n, j::n] for i in range(n) for j in range(n))
    return np.asarray(total / np.float32(n * n), dtype=np.float32)


@njit(nogil=True, cache=True)
def _rasterize(
    points: Array,
    inverse_z: Array,
    triangles: IntArray,
    faces: NDArray[np.int32],
    inverse_depths: NDArray[np.float32],
    weights: NDArray[np.float32],
) -> None:
    """Draw triangles into the arrays of a `Hits`; triangles with a corner behind the camera are left out."""
    height, width = faces.shape
    for f in range(triangles.shape[0]):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        za, zb, zc = inverse_z[a], inverse_z[b], inverse_z[c]
        if za <= 0.0 or zb <= 0.0 or zc <= 0.0:
            continue
        ax, ay, bx, by, cx, cy = points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[c, 0], points[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        x0, x1 = max(0, int(np.ceil(min(ax, bx, cx)))), min(width - 1, int(np.floor(max(ax, bx, cx))))
        y0, y1 = max(0, int(np.ceil(min(ay, by, cy)))), min(height - 1, int(np.floor(max(ay, by, cy))))
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                # 1/z is linear in the image, and so are quantities divided by z.
                iz = wa * za + wb * zb + wc * zc
                if iz > inverse_depths[y, x]:
                    inverse_depths[y, x] = iz
                    faces[y, x] = f
                    weights[y, x, 0] = wa * za / iz
                    weights[y, x, 1] = wb * zb / iz
                    weights[y, x, 2] = wc * zc / iz
