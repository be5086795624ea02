"""Measure how much of a body lies outside the silhouette in a view."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.axis_visibility import ellipsoids
from tracker.body.model import PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M

_ALONG = np.linspace(-0.8, 0.8, 5)
"""Samples along the axis of each part, in half lengths of the part."""


class AxisSamples(NamedTuple):
    """Points on the axes of the parts in a view, sample by sample."""

    shown: NDArray[np.bool_]
    """Whether each lies in the region of the view, (n_parts, n_samples)."""
    outside: NDArray[np.bool_]
    """Whether each does and lies outside the silhouette, (n_parts, n_samples)."""

    def share_outside(self, parts: NDArray[np.int64]) -> float:
        """Return the share of the shown samples of some parts that lie outside; 0 where nothing is shown."""
        return float(self.outside[parts].sum() / max(1, self.shown[parts].sum()))


def axis_samples(view: ViewEvidence, body: PosedBody) -> AxisSamples:
    """Sample the axes of all parts in a view with a silhouette. Occluded samples count: a person occludes within it."""
    assert view.silhouette is not None
    inside = view.silhouette.inside
    height, width = inside.shape
    points_camera = rigid.apply(view.camera.T_camera_world, _axis_points_world(body))
    depths = points_camera[..., 2]
    px = points_camera @ view.camera.K.T
    u, v = (np.floor(px[..., i] / np.maximum(depths, NEAR_PLANE_M) + 0.5).astype(np.int64) for i in (0, 1))
    shown = (depths > NEAR_PLANE_M) & (u >= 0) & (u < width) & (v >= 0) & (v < height)
    outside = shown & ~inside[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)]
    return AxisSamples(shown, outside)


def _axis_points_world(body: PosedBody) -> Array:
    """Return points on the axes of all parts, (n_parts, n_samples, 3), metres."""
    shapes = ellipsoids(body.model)
    points_part = np.repeat(shapes[:, None, :3], len(_ALONG), axis=1)
    points_part[..., 2] += shapes[:, 5, None] * _ALONG
    Ts = body.kinematics.Ts_world_part
    return np.asarray(points_part @ Ts[:, :3, :3].transpose(0, 2, 1) + Ts[:, None, :3, 3])
