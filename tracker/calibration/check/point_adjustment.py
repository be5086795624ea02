"""Bundle adjustment of free points: pins, imported key points or other points that several cameras see."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.lens_priors import CALIBRATED, prior_sigmas
from tracker.calibration.check.reprojection import (
    Located,
    Observations,
    Prior,
    ReprojectionProblem,
    Rig,
    RigFit,
    column_ends,
    fit_rig,
)
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray, Mask
from tracker.geometry.camera_columns import FOCAL
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import MIN_ANGLE_RAD

NEWS = 0.5
"""Largest standard deviation, as a share of that before, at which observations determine a number. At a half they have
added three times as much as was known."""
_DEPTH_QUANTILES = (0.05, 0.95)
"""Depths between which observations of a camera count as spread: the few nearest and farthest add little."""


class KnownLength(NamedTuple):
    """Distance of two points."""

    first: int
    second: int
    length_m: float


@dataclass(frozen=True, eq=False)
class AdjustedPoints:
    """Cameras and points at which the reprojection error is least."""

    cameras: tuple[Camera, ...]
    points_world: Array
    """(P, 3), metres; NaN for points that two cameras do not determine."""
    fit: RigFit
    """Noise, covariance and errors; its points are those that are determined, and its scale is that before lengths."""
    observed: Mask
    """Which of the given observations took part, (N,)."""
    held: tuple[str, ...]
    """Cameras whose lens stays as it was, with the reason, a sentence each."""


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


def adjust_points(
    cameras: Sequence[Camera],
    observations: Observations,
    intrinsics: bool = False,
    lengths: Sequence[KnownLength] = (),
) -> AdjustedPoints:
    """Fit cameras and points to observations of points.

    Weak priors on the cameras (`CALIBRATED`) fix the gauge: the world stays where it was. Known lengths fix the scale.

    Args:
        cameras: as calibrated before.
        observations: their groups are the points, numbered from 0.
        intrinsics: also correct focal lengths, principal points and distortions where the observations determine them.
        lengths: distances of points; the scale becomes that of their median.

    Raises:
        CalibrationError: fewer than two cameras see a point from different sides, all points lie on a line, or no known
            length is determined.
    """
    points, determined = triangulate_all(cameras, observations)
    observed = determined[observations.groups]
    if not observed.any():
        raise CalibrationError(
            "expected points that at least two cameras see from different sides, found none; observe more"
        )
    numbers = np.cumsum(determined) - 1
    seen = Observations(
        observations.cameras[observed], numbers[observations.groups[observed]], observations.px[observed]
    )
    rig = Rig(tuple(cameras), points[determined])
    require_spread(rig, seen)
    fit, held = _fitted(rig, seen, np.full(len(cameras), intrinsics))
    scaled = _scaled(fit.rig, numbers, determined, lengths)
    out = np.full(points.shape, np.nan)
    out[determined] = scaled.own
    return AdjustedPoints(scaled.cameras, out, fit, observed, held)


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


def _fitted(rig: Rig, seen: Observations, has_free_lens: Mask) -> tuple[RigFit, tuple[str, ...]]:
    """Fit a rig; lenses that the observations do not determine are then held, and it is fitted again."""
    sigmas = tuple(
        prior_sigmas(c, CALIBRATED, lens=bool(free)) for c, free in zip(rig.cameras, has_free_lens, strict=True)
    )
    problem = PointProblem(seen, Prior(rig.cameras, sigmas), len(rig.own), np.ones(len(rig.cameras)))
    fit = fit_rig(problem, rig)
    after = np.sqrt(np.diag(fit.covariance))[np.array(column_ends(rig.cameras)[:-1]) + FOCAL]
    is_determined = has_free_lens & (after < NEWS * CALIBRATED.focal)
    if np.array_equal(is_determined, has_free_lens):
        return fit, ()
    ratios = depth_ratios(fit.rig, seen)
    held = tuple(
        f"camera '{c.name}' keeps its lens: the points that it sees are too equally far away to tell its focal length "
        f"(the farthest {ratio:.1f} times as far as the nearest)"
        for c, ratio, free, determined in zip(rig.cameras, ratios, has_free_lens, is_determined, strict=True)
        if free and not determined
    )
    again, more = _fitted(rig, seen, is_determined)
    return again, held + more


def depth_ratios(rig: Rig, seen: Observations) -> Array:
    """Return how many times as far as the nearest point the farthest one is from each camera, (n_cameras,)."""
    out = np.ones(len(rig.cameras))
    for i, camera in enumerate(rig.cameras):
        depths = camera.depths(rig.own[seen.groups[seen.of_camera(i)]])
        if len(depths):
            near, far = np.quantile(depths, _DEPTH_QUANTILES)
            out[i] = far / near
    return out


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


def _scaled(rig: Rig, numbers: IntArray, determined: Mask, lengths: Sequence[KnownLength]) -> Rig:
    """Scale a rig about the mean of its cameras, so that the median of the known lengths is right."""
    if not lengths:
        return rig
    found = [
        known.length_m / float(np.linalg.norm(np.diff(rig.own[numbers[[known.first, known.second]]], axis=0)))
        for known in lengths
        if determined[known.first] and determined[known.second]
    ]
    if not found:
        raise CalibrationError(
            f"expected points of at least one of {len(lengths)} known lengths in two views, found none; observe them"
        )
    scale = float(np.median(found))
    middle = np.mean([c.center_world for c in rig.cameras], axis=0)
    cameras = tuple(
        replace(c, T_world_camera=rigid.transform(c.T_world_camera[:3, :3], middle + scale * (c.center_world - middle)))
        for c in rig.cameras
    )
    return Rig(cameras, middle + scale * (rig.own - middle))
