"""The room of a simulated recording: furniture, light, and the empty room as each camera sees it."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.simulate.stage.furniture import HALF_WIDTH_M, furnished
from tracker.simulate.stage.rasterizer import DIRECT, SAMPLES, covered, lit, pixel_means

LAMP_WORLD = np.array([0.7, -0.5, 2.75])
"""Centre of the ceiling lamp, metres."""
LAMP_HALF_WIDTH_M = 0.45
LAMP_POINTS = 3
"""Number of points along each side of the lamp from which shadows are cast."""
SHADOW_CELL_M = 0.015
SHADOW_STRENGTH = 0.62
"""Share of the light that a fully shaded floor loses."""


@dataclass(frozen=True, eq=False)
class Backdrop:
    """The empty room as one camera sees it, at `SAMPLES` samples per pixel along each axis."""

    camera: Camera
    """The camera of the finished images."""
    colors: NDArray[np.float32]
    """Colour of each sample, (SAMPLES * H, SAMPLES * W, 3), 0 to 1."""
    inverse_depths: NDArray[np.float32]
    """1 / depth along the optical axis of each sample, 1/m."""
    floor_cells: NDArray[np.float32]
    """Cell (x, y) of the floor's shadow map that each sample sees, -1e4 if it sees no floor; (2, ...)."""

    @property
    def sample_camera(self) -> Camera:
        """The camera of the samples."""
        return self.camera.scaled(SAMPLES)

    @cached_property
    def image(self) -> NDArray[np.float32]:
        """The empty room, (H, W, 3), 0 to 1."""
        return pixel_means(self.colors)

    def light(self, shadow: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the share of light that a shadow map (see `floor_shadow`) leaves each sample, 0 to 1."""
        shade = cv2.remap(shadow, self.floor_cells[0], self.floor_cells[1], cv2.INTER_LINEAR)
        return np.asarray(1.0 - SHADOW_STRENGTH * shade, dtype=np.float32)


def lamp_points() -> Array:
    """Return the points of the lamp from which shadows are cast, (n, 3), metres."""
    steps = np.linspace(-LAMP_HALF_WIDTH_M, LAMP_HALF_WIDTH_M, LAMP_POINTS)
    return np.array([LAMP_WORLD + np.array([x, y, 0.0]) for x in steps for y in steps])


def floor_shadow(vertices_world: Array, faces: IntArray) -> NDArray[np.float32]:
    """Return the share of the lamp, 0 to 1, that a mesh hides from each floor cell; (n, n), row y, column x."""
    n = round(2 * HALF_WIDTH_M / SHADOW_CELL_M)
    total = np.zeros((n, n), dtype=np.float32)
    for lamp in lamp_points():
        along = lamp[2] / (lamp[2] - vertices_world[:, 2:])
        on_floor = lamp[:2] + along * (vertices_world[:, :2] - lamp[:2])
        total += covered(_floor_cells(on_floor), faces, (n, n))
    return np.asarray(cv2.GaussianBlur(total / LAMP_POINTS**2, (0, 0), 2.5), dtype=np.float32)


def see_room(camera: Camera, seed: int, room: str = "laboratory") -> Backdrop:
    """Render the empty room, furnished by a random seed.

    Args:
        camera: from which it is seen.
        seed: of its furniture.
        room: one of `furniture.ROOMS`.

    Raises:
        TrackerError: there is no such kind.
    """
    boxes = furnished(seed, room)
    samples = camera.scaled(SAMPLES)
    u, v = np.meshgrid(np.arange(samples.width), np.arange(samples.height))
    rays = samples.rays(np.stack([u, v], axis=-1).reshape(-1, 2).astype(np.float64))
    solids = [np.array([getattr(b, field) for b in boxes]) for field in ("center", "half", "yaw")]
    origins = np.tile(camera.center_world, (len(rays), 1))
    seen, distances = _first_hits(origins, rays, np.full(len(rays), np.inf), False, *solids)
    points = camera.center_world + distances[:, None] * rays
    colors, normals = np.zeros((len(rays), 3)), np.zeros((len(rays), 3))
    for i in np.unique(seen):
        at = np.flatnonzero(seen == i)
        colors[at], normals[at] = boxes[i].appearance(points[at])
    shades = np.mean([_shaded(points + 1e-3 * normals, p, *solids) for p in lamp_points()], axis=0)
    # Shade removes the lamp's share of the light, not the ambient light.
    colors = lit(colors, normals, points, LAMP_WORLD) * (1.0 - DIRECT * shades)[:, None]
    on_floor = (points[:, 2] < 1e-4)[:, None]
    cells = np.where(on_floor, _floor_cells(points[:, :2]), -1e4)
    depths = camera.depths(points)
    shape = (samples.height, samples.width)
    return Backdrop(
        camera,
        np.clip(colors, 0.0, 1.0).astype(np.float32).reshape(*shape, 3),
        (1.0 / depths).astype(np.float32).reshape(shape),
        cells.T.astype(np.float32).reshape(2, *shape),
    )


def _floor_cells(points_floor: Array) -> Array:
    """Return the cells of the shadow map, cell centres at integers, of points on the floor (..., 2)."""
    return (points_floor + HALF_WIDTH_M) / SHADOW_CELL_M - 0.5


def _shaded(points: Array, lamp: Array, *boxes: Array) -> NDArray[np.bool_]:
    """Return whether something stands between points (n, 3) and a point of the lamp, (n,)."""
    to_lamp = lamp - points
    distances = np.linalg.norm(to_lamp, axis=1)
    seen, _ = _first_hits(points, to_lamp / distances[:, None], distances - 1e-3, True, *boxes)
    return seen >= 0


@njit(nogil=True, cache=True)
def _first_hits(
    origins: Array, directions: Array, reaches: Array, any_hit: bool, centers: Array, halves: Array, yaws: Array
) -> tuple[IntArray, Array]:
    """Return the index of the first box (or of any) on each ray within its reach, -1 for none, and its distance."""
    n = directions.shape[0]
    boxes, distances = np.full(n, -1, dtype=np.int64), reaches.copy()
    cosines, sines = np.cos(yaws), np.sin(yaws)
    radii2 = np.sum(halves**2, axis=1)
    for r in range(n):
        dx, dy, dz = directions[r, 0], directions[r, 1], directions[r, 2]
        for b in range(centers.shape[0]):
            ox, oy, oz = origins[r, 0] - centers[b, 0], origins[r, 1] - centers[b, 1], origins[r, 2] - centers[b, 2]
            along = ox * dx + oy * dy + oz * dz
            # Most boxes are small and far from the ray: test their bounding spheres first.
            if ox * ox + oy * oy + oz * oz - along * along > radii2[b]:
                continue
            c, s = cosines[b], sines[b]
            low, high = 1e-6, distances[r]
            for i in range(3):
                o = c * ox + s * oy if i == 0 else (c * oy - s * ox if i == 1 else oz)
                d = c * dx + s * dy if i == 0 else (c * dy - s * dx if i == 1 else dz)
                d = d if abs(d) > 1e-12 else 1e-12
                t0, t1 = (-halves[b, i] - o) / d, (halves[b, i] - o) / d
                low, high = max(low, min(t0, t1)), min(high, max(t0, t1))
            if low < high and low > 1e-6:
                boxes[r], distances[r] = b, low
                if any_hit:
                    break
    return boxes, distances
