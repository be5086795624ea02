"""Score one limb in thousands of poses by the colours and edges along it, with the rest of the scene static.

The static parts are drawn once per view, within reach of the limb: the nearest part and its depth in each image cell. A
sample of a limb then finds in one lookup whether it is occluded, and what would be visible without the limb. Only the
limb's own parts are tested one by one.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics, chain_poses
from tracker.body.model import BodyModel
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.appearance.axis_visibility import (
    ALONG,
    axis_sample,
    is_occluded,
    pixel_on_axis,
    project_axis,
    ray_transform,
)
from tracker.evidence.images.color_histogram import BINS, bin_of
from tracker.geometry.arrays import Array, FloatArray, Image, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M

_STEP_PX = 2
"""Size of a cell, working px."""
_BESIDE_PX = 3.0
"""Margin around all positions that the limb can reach, px."""
_OPEN = -1
"""Part index of cells without a part."""
_OFF_NATS = -0.25
"""Score of a pixel outside the image: slightly against the limb, because it is not seen."""
_EDGE_NATS, _EDGE_EVEN = 1.5, 0.3
"""Weight of an edge beside the limb, and the distance of an edge that counts nothing, in outlier distances."""


class ColorView(NamedTuple):
    """Evidence of one view for scoring limbs."""

    P: Array
    """Projection matrix to working pixels, (3, 4)."""
    eye: Array
    """Camera centre in the world, (3,), metres."""
    image: Image
    """Colours, (H, W, 3)."""
    distance: FloatArray
    """Distance to the nearest edge, (H, W), working px."""
    theta_px: float
    """Outlier distance, working px."""


class LimbScore(Protocol):
    """Scores one limb of an otherwise static body in many poses."""

    def __call__(self, poses: Array) -> Array:
        """See `LimbScorer`."""


class StaticParts(NamedTuple):
    """Parts that may occlude a limb, or be visible without it."""

    Ts_world_unit: Array
    """From the coordinates in which each part is the unit ball to the world, (S, 4, 4), metres."""
    owners: IntArray
    """Index of each part in the scored body, (S,); -1 for parts of other bodies."""


class _Backdrop(NamedTuple):
    """Static parts in one view within reach of a limb."""

    depths: NDArray[np.float32]
    """Depth of the middle of the nearest part along the ray, (h, w), metres; infinite without a part."""
    owners: NDArray[np.int16]
    """Index of that part in the scored body, (h, w); -1 for parts of other bodies and without a part."""
    corner_px: IntArray
    """Pixel at the middle of the first cell, u and v, (2,)."""


class _Limb(NamedTuple):
    """The limb in all poses, for the kernels."""

    Ts: Array
    """Poses of its parts, (C, n, 4, 4), metres."""
    shapes: Array
    """Ellipsoids of its parts, (n, 6), metres."""
    parts: IntArray
    """Indices of its parts in the body, (n,)."""
    log_ratios: Array
    """Log ratios of the colours of all parts of the body, (n_parts, BINS^3), nats; see `PartColors`."""


class _Scratch(NamedTuple):
    """Buffers of the kernels."""

    own_parts: IntArray
    """0 to n - 1, (n,)."""
    rays: Array
    """See `ray_transform`, (n, 13)."""
    axis: Array
    """See `project_axis`, (4, 3)."""


class LimbScorer:
    """Scores one limb of an otherwise static body in many poses."""

    def __init__(
        self, views: Sequence[ColorView], model: BodyModel, rest: Kinematics, limb: IntArray, static: StaticParts,
        shapes: Array, log_ratios: Array | None,
    ) -> None:  # fmt: skip
        """Draw the static parts.

        Args:
            views: views with colours.
            model: the body.
            rest: kinematics of the body; the limb may be anywhere.
            limb: indices of the limb's parts, from the trunk outwards, (n,).
            static: the static parts.
            shapes: ellipsoids of all parts of the body, (n_parts, 6), metres.
            log_ratios: log ratios of the colours of the body's parts, see `PartColors`; None if unknown.
        """
        self._views, self._model, self._rest, self._limb = list(views), model, rest, limb
        self._shapes = np.ascontiguousarray(shapes[limb])
        self._ratios = np.zeros((len(shapes), BINS**3)) if log_ratios is None else log_ratios
        reach = _reach(model, limb, self._shapes)
        root = rest.Ts_world_part[limb[0], :3, 3]
        # Sequential: the work is too small for threads.
        self._backdrops = [_backdrop(view, static, root, reach) for view in self._views]

    def __call__(self, poses: Array) -> Array:
        """Return the score of the limb in many poses, (C, n_values), that differ in the limb only, (C,), nats.

        Larger is better. Visible samples along the axes of the limb's parts count with their colours and with the edges
        on both sides: near edges for the limb, missing edges against it. Occluded samples count nothing. Runs in the
        calling thread; several threads may call at a time.
        """
        Ts = chain_poses(self._model.tree, self._rest, self._limb, poses)
        limb = _Limb(Ts, self._shapes, self._limb, self._ratios)
        scratch = _Scratch(np.arange(len(self._limb)), np.empty((len(self._limb), 13)), np.empty((4, 3)))
        total, nats = np.zeros(len(poses)), np.zeros(len(poses))
        for view, backdrop in zip(self._views, self._backdrops, strict=True):
            _score_view(view, backdrop, limb, scratch, nats)
            total += nats
        return total


def _reach(model: BodyModel, limb: IntArray, shapes: Array) -> float:
    """Return the largest distance of a limb's samples from its first joint, metres."""
    lengths = np.linalg.norm(model.tree.offsets[limb], axis=1)
    lengths[0] = 0.0
    return float((np.cumsum(lengths) + np.linalg.norm(shapes[:, :3], axis=1) + shapes[:, 5]).max())


def _backdrop(view: ColorView, static: StaticParts, root: Array, reach: float) -> _Backdrop:
    """Draw the static parts within reach, metres, of a position, (3,)."""
    bounds, ball = np.empty(4), np.diag([reach, reach, reach, 1.0])
    ball[:3, 3] = root
    _bounds(view.P @ ball, bounds)
    # Occlusion farther outside an image than its own size is irrelevant.
    size = np.array(view.distance.shape[::-1])
    low = np.clip(np.floor(bounds[:2] - _BESIDE_PX), -size, 2 * size).astype(np.int64)
    high = np.clip(np.ceil(bounds[2:] + _BESIDE_PX), -size, 2 * size).astype(np.int64)
    columns, rows = np.maximum(0, (high - low) // _STEP_PX + 1)
    depths, owners = np.full((rows, columns), np.inf, np.float32), np.full((rows, columns), _OPEN, np.int16)
    Ts_unit_world = np.linalg.inv(static.Ts_world_unit)
    rays = Ts_unit_world[:, :3, :3] @ np.linalg.inv(view.P[:, :3])
    eyes = Ts_unit_world[:, :3] @ np.append(view.eye, 1.0)
    _draw(view.P @ static.Ts_world_unit, rays, eyes, static.owners, low, depths, owners, bounds)
    return _Backdrop(depths, owners, low)


@njit(**NO_REFCOUNT)
def _draw(
    to_px: Array, rays: Array, eyes: Array, own: IntArray, corner: IntArray, depths: NDArray[np.float32],
    owners: NDArray[np.int16], bounds: Array,
) -> None:  # fmt: skip
    """Draw parts into a backdrop.

    Args:
        to_px: from the coordinates in which each part is the unit ball to homogeneous pixels, (S, 3, 4).
        rays: from pixels to directions of depth 1 in these coordinates, (S, 3, 3).
        eyes: the eye in these coordinates, (S, 3).
        own: owners of the parts, see `StaticParts`.
        corner: see `_Backdrop`.
        depths: filled, see `_Backdrop`.
        owners: filled, see `_Backdrop`.
        bounds: scratch, (4,).
    """
    for p in range(len(to_px)):
        _bounds(to_px[p], bounds)
        left, right = (bounds[0] - corner[0]) / _STEP_PX, (bounds[2] - corner[0]) / _STEP_PX
        top, bottom = (bounds[1] - corner[1]) / _STEP_PX, (bounds[3] - corner[1]) / _STEP_PX
        left, right = max(0.0, np.ceil(left)), min(depths.shape[1] - 1.0, np.floor(right))
        top, bottom = max(0.0, np.ceil(top)), min(depths.shape[0] - 1.0, np.floor(bottom))
        if left > right or top > bottom:  # infinite bounds would overflow an integer
            continue
        N, x, y, z = rays[p], eyes[p, 0], eyes[p, 1], eyes[p, 2]
        C, owner = x * x + y * y + z * z - 1.0, np.int16(own[p])
        for row in range(int(top), int(bottom) + 1):
            v = corner[1] + _STEP_PX * row
            bx, by, bz = N[0, 1] * v + N[0, 2], N[1, 1] * v + N[1, 2], N[2, 1] * v + N[2, 2]
            for column in range(int(left), int(right) + 1):
                u = corner[0] + _STEP_PX * column
                dx, dy, dz = N[0, 0] * u + bx, N[1, 0] * u + by, N[2, 0] * u + bz
                A = dx * dx + dy * dy + dz * dz
                B = x * dx + y * dy + z * dz
                if B < 0.0 and B * B > A * C and A * depths[row, column] > -B:
                    depths[row, column] = -B / A
                    owners[row, column] = owner


@njit(**NO_REFCOUNT)
def _bounds(to_px: Array, bounds: Array) -> None:
    """Fill the bounds u0, v0, u1, v1 of a ball in an image, (4,), px.

    They are infinite if the ball reaches the camera plane, and empty if it is behind.

    Args:
        to_px: from the coordinates in which it is the unit ball to homogeneous pixels, (3, 4).
        bounds: filled.
    """
    ww = _dual_conic(to_px, 2, 2)
    for i in range(2):
        if ww >= 0.0:
            bounds[i], bounds[i + 2] = -np.inf, np.inf
        elif to_px[2, 3] <= 0.0:
            bounds[i], bounds[i + 2] = np.inf, -np.inf
        else:
            uw = _dual_conic(to_px, i, 2)
            root = np.sqrt(max(0.0, uw * uw - _dual_conic(to_px, i, i) * ww))
            bounds[i], bounds[i + 2] = (uw + root) / ww, (uw - root) / ww


@njit(**NO_REFCOUNT)
def _dual_conic(to_px: Array, i: int, j: int) -> float:
    """Return an entry of the dual conic C of a ball's image: a line l is tangent where l^T C l = 0."""
    near = to_px[i, 0] * to_px[j, 0] + to_px[i, 1] * to_px[j, 1] + to_px[i, 2] * to_px[j, 2]
    return float(near - to_px[i, 3] * to_px[j, 3])


@njit(**NO_REFCOUNT)
def _score_view(view: ColorView, backdrop: _Backdrop, limb: _Limb, scratch: _Scratch, nats: Array) -> None:
    """Fill the score of the limb in one view in each pose, (C,), nats.

    Args:
        view: the view.
        backdrop: static parts in the view.
        limb: the limb in all poses.
        scratch: buffers.
        nats: filled.
    """
    P, eye, image, distance, theta_px = view
    depths, owners, corner = backdrop
    Ts, shapes, parts, log_ratios = limb
    own_parts, rays, axis = scratch
    n_parts = parts.shape[0]
    for c in range(Ts.shape[0]):
        for i in range(n_parts):
            ray_transform(eye, Ts[c, i], shapes[i], rays[i])
        total = 0.0
        for i in range(n_parts):
            project_axis(P, eye, Ts[c, i], shapes[i], axis)
            for sample in range(ALONG):
                z = axis_sample(shapes[i], sample)
                depth = axis[1, 2] + z * axis[2, 2]
                if depth < NEAR_PLANE_M or is_occluded(Ts[c, i], axis, z, i, rays, own_parts, n_parts):
                    continue
                behind = _OPEN
                u, v, du, dv = pixel_on_axis(axis, z)
                column = int(np.floor((u - corner[0]) * (1.0 / _STEP_PX) + 0.5))
                row = int(np.floor((v - corner[1]) * (1.0 / _STEP_PX) + 0.5))
                if 0 <= row < depths.shape[0] and 0 <= column < depths.shape[1]:
                    if depths[row, column] < depth:
                        continue
                    behind = owners[row, column]
                step = 0.5 * shapes[i, 3]
                total += _sample_nats(
                    u, v, du * step, dv * step, image, distance, theta_px, log_ratios, parts[i], behind
                )
        nats[c] = total


@njit(**NO_REFCOUNT)
def _sample_nats(
    u: float, v: float, du: float, dv: float, image: Image, distance: FloatArray, theta_px: float, log_ratios: Array,
    part: int, behind: int,
) -> float:  # fmt: skip
    """Return the score of the pixels across a part, two steps to either side of a sample on its axis.

    Args:
        u: column of the sample, px.
        v: row of the sample, px.
        du: step across, px.
        dv: step across, px.
        view: the view.
        log_ratios: see `_Limb`.
        part: index of the part.
        behind: index of the part visible without the limb; -1 for none.
    """
    height, width = distance.shape
    nats, per_theta = 0.0, 1.0 / theta_px
    for s in range(-2, 3):
        x, y = int(np.floor(u + s * du + 0.5)), int(np.floor(v + s * dv + 0.5))
        if x < 0 or y < 0 or x >= width or y >= height:
            nats += _OFF_NATS
        elif s == -2 or s == 2:
            nats += _EDGE_NATS * (_EDGE_EVEN - min(distance[y, x] * per_theta, 1.0))
        else:
            color = bin_of(image, y, x)
            nats += log_ratios[part, color]
            if behind >= 0:  # Matching the colour behind the limb is no evidence for it.
                nats -= log_ratios[behind, color]
    return nats
