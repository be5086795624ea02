"""Kernels of region evidence: they count, calibrate and sum over the cells of one view.

`share` is that of a cell in an independent sample at a depth of 1 m, per m^2. Tables are those of one view.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.appearance.part_drawing import Canvas, face_in_image, nearness_at, project_mesh
from tracker.evidence.images.color_histogram import bin_of
from tracker.geometry.arrays import Array, FloatArray, Image, IntArray

N_RATIOS, RATIO_STEP = 48, 0.5
"""Number of bins of the log ratio r, which is 0 in the middle, and their width, nats."""


class RegionTables(NamedTuple):
    """Tables learnt of the parts in one view, or in several with one more axis in front. Parts are counted through all
    bodies."""

    log_density: FloatArray
    """Log density of each colour on each part, (P, BINS^3), per cubic gray level."""
    log_rest: FloatArray
    """Log density of each colour on the rest of the person, (P, BINS^3), per cubic gray level."""
    trust: FloatArray
    """T of each bin of r, (P, `N_RATIOS`), nats."""

    def by_view(self) -> tuple["RegionTables", ...]:
        """Return the tables of each of several views."""
        return tuple(map(RegionTables, *self))


class LimbImages(NamedTuple):
    """A view in which only a limb moves."""

    static: Canvas
    """The other parts."""
    static_nats: FloatArray
    """Evidence of each cell for the other parts, (h, w), nats."""
    trust: FloatArray
    """T of each part of the limb in each cell, (n, h, w), nats."""


class LimbCanvas(NamedTuple):
    """Scratch for the limb in one view."""

    nearness: FloatArray
    """1 / depth of the limb, (h, w), 1/m."""
    nats: FloatArray
    """Evidence of the cell for the limb, (h, w), nats."""
    drawn: NDArray[np.int32]
    """1 + the last pose of the limb that covers each cell, (h, w); 0 at first."""


@njit(**NO_REFCOUNT)
def ratio_bin(tables: RegionTables, part: int, color: int, background: float) -> int:
    """Return the bin of r of a colour: that of the part against the likelier of background and rest of the body."""
    ratio = tables.log_density[part, color] - max(tables.log_rest[part, color], background)
    return min(N_RATIOS - 1, max(0, int(np.floor(ratio / RATIO_STEP)) + N_RATIOS // 2))


@njit(**NO_REFCOUNT)
def count_colors(colors: Image, canvas: Canvas, share: float, weight: Array, counts: Array) -> None:
    """Add the colours under each part to histograms, (P, BINS^3), in samples, by the weight of each part, (P,)."""
    nearness, labels = canvas
    for v in range(labels.shape[0]):
        for u in range(labels.shape[1]):
            if labels[v, u]:
                p = labels[v, u] - 1
                counts[p, bin_of(colors, v, u)] += weight[p] * share / nearness[v, u] ** 2


@njit(**NO_REFCOUNT)
def count_ratios(
    colors: Image, canvas: Canvas, share: float, background: FloatArray, tables: RegionTables, weight: Array,
    under: Array,
) -> None:  # fmt: skip
    """Add r under each part to histograms, (P, `N_RATIOS`), in samples, by the weight of each part, (P,)."""
    nearness, labels = canvas
    for v in range(labels.shape[0]):
        for u in range(labels.shape[1]):
            if labels[v, u]:
                p = labels[v, u] - 1
                k = ratio_bin(tables, p, bin_of(colors, v, u), background[v, u])
                under[p, k] += weight[p] * share / nearness[v, u] ** 2


@njit(**NO_REFCOUNT)
def count_ratios_around(
    colors: Image, canvas: Canvas, share: float, background: FloatArray, tables: RegionTables, reach: float,
    around: Array,
) -> None:  # fmt: skip
    """Add r around each visible part to histograms, (P, `N_RATIOS`), in samples.

    The surroundings of a part are its bounding box grown by `reach`, cells times metres, without the part and the two
    cells next to it. Every second row and column counts.
    """
    nearness, labels = canvas
    height, width = labels.shape
    for p in range(around.shape[0]):
        top, bottom, left, right, near = height, -1, width, -1, 0.0
        for v in range(height):
            for u in range(width):
                if labels[v, u] == p + 1:
                    top, bottom, left, right = min(top, v), v, min(left, u), max(right, u)
                    near = max(near, nearness[v, u])
        if bottom < 0:
            continue
        margin, weight = int(reach * near), 4.0 * share / near**2
        for v in range(max(0, top - margin), min(height, bottom + margin + 1), 2):
            for u in range(max(0, left - margin), min(width, right + margin + 1), 2):
                if not (
                    labels[v, u] == p + 1
                    or labels[max(0, v - 2), u] == p + 1
                    or labels[min(height - 1, v + 2), u] == p + 1
                    or labels[v, max(0, u - 2)] == p + 1
                    or labels[v, min(width - 1, u + 2)] == p + 1
                ):
                    around[p, ratio_bin(tables, p, bin_of(colors, v, u), background[v, u])] += weight


@njit(**NO_REFCOUNT)
def add_score(
    colors: Image, canvas: Canvas, share: float, background: FloatArray, tables: RegionTables, nats: Array,
    samples: Array,
) -> None:  # fmt: skip
    """Add the evidence of each visible part, (P,), nats, and the samples that show it, (P,)."""
    nearness, labels = canvas
    for v in range(labels.shape[0]):
        for u in range(labels.shape[1]):
            if labels[v, u]:
                p, w = labels[v, u] - 1, share / nearness[v, u] ** 2
                nats[p] += w * tables.trust[p, ratio_bin(tables, p, bin_of(colors, v, u), background[v, u])]
                samples[p] += w


@njit(**NO_REFCOUNT)
def fill_limb_images(
    colors: Image, share: float, background: FloatArray, tables: RegionTables, parts: IntArray, images: LimbImages
) -> None:
    """Fill the evidence of each cell for the static parts, and T of some parts, (n,)."""
    nearness, labels = images.static
    for v in range(labels.shape[0]):
        for u in range(labels.shape[1]):
            color = bin_of(colors, v, u)
            images.static_nats[v, u] = 0.0
            if labels[v, u]:
                p = labels[v, u] - 1
                t = tables.trust[p, ratio_bin(tables, p, color, background[v, u])]
                images.static_nats[v, u] = share / nearness[v, u] ** 2 * t
            for i in range(parts.shape[0]):
                p = parts[i]
                images.trust[i, v, u] = tables.trust[p, ratio_bin(tables, p, color, background[v, u])]


@njit(**NO_REFCOUNT)
def add_limb_scores(
    points: FloatArray, faces: NDArray[np.int32], to_px: FloatArray, share: float, images: LimbImages,
    canvas: LimbCanvas, corners: FloatArray, nats: Array,
) -> None:  # fmt: skip
    """Add what each pose of a limb adds to the evidence of the static parts, (C,), nats.

    Args:
        points: corners of the limb's parts, (n, 3, k), metres; see `Meshes`.
        faces: see `Meshes`.
        to_px: from the coordinates of each part to homogeneous cells, (C, n, 3, 4).
        share: see above.
        images: the view.
        canvas: scratch.
        corners: scratch, (k, 3).
        nats: added to.
    """
    nearness, own, drawn = canvas
    height, width = nearness.shape
    hidden = images.static.nearness
    for c in range(to_px.shape[0]):
        total = 0.0
        for part in range(points.shape[0]):
            if not project_mesh(points[part], to_px[c, part], corners):
                continue
            for f in range(faces.shape[0]):
                face, (top, bottom, left, right) = face_in_image(corners, faces[f], width, height)
                for v in range(top, bottom):
                    for u in range(left, right):
                        near = nearness_at(face, u, v)
                        if near <= hidden[v, u]:
                            continue
                        if drawn[v, u] != c + 1:
                            total -= images.static_nats[v, u]
                            drawn[v, u] = c + 1
                        elif near <= nearness[v, u]:
                            continue
                        else:
                            total -= own[v, u]
                        nearness[v, u] = near
                        own[v, u] = share / near**2 * images.trust[part, v, u]
                        total += own[v, u]
        nats[c] += total
