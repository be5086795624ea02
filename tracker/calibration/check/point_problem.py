"""Free points that several cameras see, such as joints: as a least-squares problem, and triangulated."""

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from tracker.calibration.check.rig_adjustment import Located, Observations, ReprojectionProblem, Rig
from tracker.errors import CalibrationError
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import MIN_ANGLE_RAD


class PointProblem(ReprojectionProblem):
    """Free points: each is a group with three unknowns."""

    n_own = 3
    has_common_noise = True

    def locate(self, own: Array) -> Located:
        """See `ReprojectionProblem`."""
        return Located(own[self.observations.groups], None)

    def move_own(self, own: Array, step: Array) -> Array:
        """See `ReprojectionProblem`."""
        return own + step

    def with_groups(self, chosen: Mask) -> Self:
        """Return the problem of some points, by a mask, (P,)."""
        out = copy(self)
        out.observations, out.n_groups = self.observations.of_groups(chosen), int(chosen.sum())
        return out


def require_spread(rig: Rig, seen: Observations) -> None:
    """Check that the points do not lie on a line, about which a camera could turn with all that it sees.

    They do if most observations are nearer to the line than a pixel, or than their own reprojection error.
    """
    middle = rig.own.mean(axis=0)
    along = np.linalg.svd(rig.own - middle, full_matrices=False)[2][0]
    on_line = middle + np.outer((rig.own - middle) @ along, along)
    off_px, errors_px = list[Array](), list[Array]()
    for i, camera in enumerate(rig.cameras):
        at = seen.of_camera(i)
        shown = camera.project(rig.own[seen.groups[at]])
        off_px.append(np.linalg.norm(camera.project(on_line[seen.groups[at]]) - shown, axis=1))
        errors_px.append(np.linalg.norm(seen.px[at] - shown, axis=1))
    off, error = (float(np.nanmedian(np.concatenate(each))) for each in (off_px, errors_px))
    if off < max(1.0, error):
        raise CalibrationError(
            f"expected points that do not all lie on one line, found them {off:.1f} px from it at an error of "
            f"{error:.1f} px; observe points beside it, or cameras could turn about it"
        )


def triangulate_all(cameras: Sequence[Camera], observations: Observations) -> tuple[Array, Mask]:
    """Find the point nearest to the rays of each group, in the least squares sense.

    Returns:
        Points, (G, 3), metres, and whether each is determined, (G,): by rays that differ, in front of the cameras.
    """
    n = int(observations.groups.max(initial=-1)) + 1
    parts = [observations.of_camera(i) for i in range(len(cameras))]
    rays = np.concatenate([c.rays(observations.px[at]) for c, at in zip(cameras, parts, strict=True)])
    centers = np.stack([c.center_world for c in cameras])[observations.cameras]
    valid = np.isfinite(rays).all(axis=1)
    groups, rays, centers = observations.groups[valid], rays[valid], centers[valid]
    across = np.eye(3) - rays[:, :, None] * rays[:, None]
    A, b = np.zeros((n, 3, 3)), np.zeros((n, 3))
    np.add.at(A, groups, across)
    np.add.at(b, groups, (across @ centers[:, :, None])[..., 0])
    # Of two rays at an angle, the least eigenvalue is 1 - cos of it; more rays raise it.
    determined = np.asarray(np.linalg.eigvalsh(A)[:, 0] > 1 - np.cos(MIN_ANGLE_RAD))
    A[~determined] = np.eye(3)
    points = np.asarray(np.linalg.solve(A, b[:, :, None])[..., 0], dtype=np.float64)
    behind = np.sum((points[groups] - centers) * rays, axis=1) <= 0
    determined[groups[behind]] = False
    return points, determined
