"""Film posed figures in a room: images, masks, and the noise of a sensor."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array, Image, IntArray
from tracker.simulate.stage.rasterizer import Figure, cast, lit, pixel_means, vertex_normals
from tracker.simulate.stage.room import LAMP_WORLD, Backdrop, floor_shadow

READ_NOISE = 1.6
"""Standard deviation of a dark pixel, gray levels."""
SHOT_NOISE = 0.085
"""Variance added per gray level of brightness, gray levels."""
FLICKER = 0.006
"""Standard deviation of the exposure from frame to frame."""


class Moment(NamedTuple):
    """All figures at one time, as one mesh, with their shadow."""

    vertices_world: Array
    """(N, 3), metres."""
    normals_world: Array
    """(N, 3), outward."""
    faces: IntArray
    """(M, 3)."""
    figures: tuple[Figure, ...]
    first_faces: IntArray
    """Index of the first triangle of each figure, and finally M; (n_figures + 1,)."""
    shadow: NDArray[np.float32]
    """See `room.floor_shadow`."""

    @property
    def face_figures(self) -> IntArray:
        """Index of the figure of each triangle, (M,)."""
        return np.repeat(np.arange(len(self.figures)), np.diff(self.first_faces))


def freeze(figures: Sequence[Figure], poses: Sequence[Array]) -> Moment:
    """Pose each figure and join their meshes."""
    vertices = [figure.posed(values) for figure, values in zip(figures, poses, strict=True)]
    normals = [vertex_normals(v, figure.faces) for figure, v in zip(figures, vertices, strict=True)]
    first_vertices = np.cumsum([0, *(len(v) for v in vertices)])
    faces = np.concatenate([f.faces + first for f, first in zip(figures, first_vertices[:-1], strict=True)])
    first_faces = np.cumsum([0, *(len(f.faces) for f in figures)])
    points = np.concatenate(vertices)
    return Moment(points, np.concatenate(normals), faces, tuple(figures), first_faces, floor_shadow(points, faces))


def film(backdrop: Backdrop, moment: Moment) -> tuple[NDArray[np.float32], Image]:
    """Take one image without noise.

    Returns:
        The image, (H, W, 3), 0 to 1, in the camera's original pixels; and the mask, (H, W): 0 for the room, k + 1 for
        the figure k that covers most of a pixel, if figures cover half of it.
    """
    hits = cast(backdrop.sample_camera, moment.vertices_world, moment.faces, backdrop.inverse_depths)
    # Light varies little within a pixel, but it is evaluated for each sample, because of the edges of the floor.
    colors = backdrop.colors * backdrop.light(moment.shadow)[..., None]
    on_figure = hits.faces >= 0
    seen, weights = hits.faces[on_figure], hits.weights[on_figure].astype(np.float64)
    corners = moment.faces[seen]
    points = np.einsum("nk,nkc->nc", weights, moment.vertices_world[corners])
    normals = np.einsum("nk,nkc->nc", weights, moment.normals_world[corners])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    who = moment.face_figures[seen]
    albedo = np.empty((len(seen), 3))
    for i, figure in enumerate(moment.figures):
        albedo[who == i] = figure.colors(seen[who == i] - moment.first_faces[i], weights[who == i])
    colors[on_figure] = np.clip(lit(albedo, normals, points, LAMP_WORLD), 0.0, 1.0)
    labels = np.zeros(on_figure.shape, dtype=np.uint8)
    labels[on_figure] = who + 1
    return pixel_means(colors), _majority(labels, len(moment.figures))


def exposed(image: NDArray[np.float32], rng: np.random.Generator) -> Image:
    """Simulate the sensor: noise, flicker and quantization of an image, (H, W, 3), 0 to 1."""
    levels = 255.0 * image * np.float32(1.0 + FLICKER * rng.standard_normal())
    deviation = np.sqrt(READ_NOISE**2 + SHOT_NOISE * levels, dtype=np.float32)
    noisy = levels + deviation * rng.standard_normal(levels.shape, dtype=np.float32)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)


def _majority(labels: Image, n_figures: int) -> Image:
    """Return the mask of pixels from labels of samples: the figure with most samples, if half of them show any."""
    assert n_figures < 256
    counts = np.stack([pixel_means((labels == i + 1).astype(np.float32)) for i in range(n_figures)])
    mask = np.argmax(counts, axis=0) + 1
    mask[counts.sum(axis=0) < 0.5] = 0
    return mask.astype(np.uint8)
