"""Find the major axis of a body in space from the axes of its silhouettes, and the head along it (GD96 Sect. 4.1).

Find the major axis of a silhouette by iterative principal component analysis (GD96 Sect. 4.1, Fig. 5).

Arms beside the trunk turn the first axis. Each round removes the points far aside of the axis, and finds it again.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.generators.standing_body import StandingBody
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera

_LATERAL = 2.0
"""Points farther aside of the axis are removed, in standard deviations of the points that are kept. A strip of even
width keeps all its points: its border lies at sqrt(3)."""
_MAX_ROUNDS = 12
"""Largest number of rounds. They end before where no other points are removed. With raised arms, more rounds would turn
the axis by 6 degrees (test_body_axis.py)."""
_MAX_POINTS = 5000
"""Largest number of points that are sampled from a silhouette."""
_MIN_POINTS = 30
"""Smallest number of pixels of a silhouette that has an axis."""


class MajorAxis(NamedTuple):
    """The major axis of the silhouette of one person in one view."""

    camera: Camera
    """Without lens distortion, at working scale."""
    points_px: Array
    """Points sampled from the silhouette, (n, 2), undistorted working px."""
    n_pixels: int
    """Number of pixels of the silhouette."""
    lines_px: Array
    """Ends of the successive approximations, (n_rounds, 2, 2), undistorted working px; the last is the axis."""
    elongation: float
    """1 less the ratio of the spreads across and along the axis: 0 for a disc, nearly 1 for a line."""

    @property
    def normal_world(self) -> Array:
        """Unit normal of the plane through the camera's centre and the axis, (3,)."""
        a, b = self.camera.rays(self.lines_px[-1])
        normal = np.cross(a, b)
        return np.asarray(normal / np.linalg.norm(normal))


def major_axis(mask: Mask, camera: Camera) -> MajorAxis | None:
    """Return the major axis of a silhouette; None if it has too few pixels.

    Args:
        mask: silhouette of one person, (H, W), raw pixels.
        camera: camera of these pixels, with its lens distortion.
    """
    rows, columns = np.nonzero(mask)
    if len(rows) < _MIN_POINTS:
        return None
    chosen = np.linspace(0, len(rows) - 1, min(len(rows), _MAX_POINTS)).astype(np.intp)
    points = camera.undistort_points(np.column_stack([columns, rows])[chosen].astype(np.float64))
    if camera.fisheye:  # far aside, a few pixels would outweigh the rest
        points = points[np.all((points >= -0.5) & (points <= np.array(camera.pinhole.size) - 0.5), axis=1)]
        if len(points) < _MIN_POINTS:
            return None
    kept, lines, elongation = np.ones(len(points), bool), [], 0.0
    for _ in range(_MAX_ROUNDS):
        center = points[kept].mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(points[kept].T))
        along, across = axes[:, 1], axes[:, 0]
        elongation = float(1 - np.sqrt(max(0.0, variances[0]) / variances[1]))
        ends = (points[kept] - center) @ along
        lines.append(center + np.outer([ends.min(), ends.max()], along))
        before, kept = kept, np.abs((points - center) @ across) <= _LATERAL * np.sqrt(variances[0])
        if np.array_equal(kept, before):
            break
    return MajorAxis(camera.pinhole, points, len(rows), np.array(lines), elongation)


_MAX_OFF_RAD = np.radians(20)
"""Largest angle between the axis and the plane of a view that agrees with the others. Planes that are as near to each
other are the same, as those of views from opposite sides: they determine no axis."""


class BodyAxis(NamedTuple):
    """The major axis of a body."""

    up: Array
    """Unit direction from the legs to the head, (3,)."""
    top: Array
    """Top of the head, on the axis, (3,), metres."""
    misfit: float
    """Mean difference of the widths along the axis from those of the body's head, metres."""
    views: tuple[MajorAxis, ...]
    """The axes of all views that are used."""
    left_out: tuple[str, ...]
    """Names of views whose axis contradicts the others."""


def find_body_axes(axes: Sequence[MajorAxis], up: Array, body: StandingBody) -> list[BodyAxis]:
    """Return the axis of a body with each place that may be its head, the best first.

    Args:
        axes: of the silhouettes of one person.
        up: vertical axis of the world, (3,); of two heads that fit alike, the upper one is first.
        body: of the person, as far as it is known.

    Raises:
        TrackerError: fewer than two views from different sides agree, or no head is found along the axis.
    """
    used, direction = _direction(axes)
    names = {a.camera.name for a in used}
    left_out = tuple(a.camera.name for a in axes if a.camera.name not in names)
    direction = direction if direction @ up >= 0 else -direction
    center = _center(used, direction)
    found = []
    for sign in (1.0, -1.0):
        along, widths = _profile(used, center, sign * direction, body)
        for top_m, misfit in _heads(along, widths, body):
            top = center + sign * top_m * direction
            found.append(BodyAxis(sign * direction, top, misfit, used, left_out))
    if not found:
        raise TrackerError(
            "expected a head along the silhouettes' axis, found none",
            Remedy("another_frame", condition="the person stands with the arms away from the head"),
        )
    return sorted(found, key=lambda axis: axis.misfit)


def _direction(axes: Sequence[MajorAxis]) -> tuple[tuple[MajorAxis, ...], Array]:
    """Return the direction that lies in the planes of the views, (3,), and the views that agree with it.

    The view is left out without which the others agree best, until all that are left agree.
    """
    used = tuple(axes)
    while len(used) >= 2:
        found = _common_direction(used)
        if found is None:
            break
        direction, off = found
        if off <= _MAX_OFF_RAD or len(used) == 2:
            return used, direction
        rests = [tuple(a for a in used if a is not left_out) for left_out in used]
        offs = [np.inf if (common := _common_direction(rest)) is None else common[1] for rest in rests]
        used = rests[int(np.argmin(offs))]
    raise TrackerError(
        f"expected the person in at least 2 views from different sides, found {len(used)} that agree",
        Remedy("another_frame_or_camera"),
    )


def _common_direction(axes: Sequence[MajorAxis]) -> tuple[Array, float] | None:
    """Return the direction nearest to the planes of views, (3,), and its largest angle to one, rad; None where the
    planes are nearly the same."""
    planes = np.array([a.elongation * a.normal_world for a in axes])
    _, spreads, directions = np.linalg.svd(planes)
    if spreads[1] < np.tan(_MAX_OFF_RAD / 2) * spreads[0]:
        return None
    off = max(abs(float(np.arcsin(np.clip(a.normal_world @ directions[2], -1, 1)))) for a in axes)
    return directions[2], off


def _center(axes: Sequence[MajorAxis], direction: Array) -> Array:
    """Return the point nearest to all planes, and along the axis nearest to the rays through the centres, (3,)."""
    eyes = np.array([a.camera.center_world for a in axes])
    planes = np.array([a.elongation * np.outer(a.normal_world, a.normal_world) for a in axes])
    center = np.linalg.solve(planes.sum(axis=0) + np.outer(direction, direction), np.einsum("nij,nj->i", planes, eyes))
    rays = np.array([a.camera.rays(a.lines_px[-1].mean(axis=0)) for a in axes])
    across = direction - (rays @ direction)[:, None] * rays
    return np.asarray(center + np.sum(across * (eyes - center)) / np.sum(across @ direction) * direction)


def _along(axis: MajorAxis, center: Array, direction: Array) -> tuple[Array, Array, Array]:
    """Return the places of a silhouette's points along the axis, their distances from it, and their areas.

    All are (n,), in metres, the areas in square metres.
    """
    eye = axis.camera.center_world
    rays = axis.camera.rays(axis.points_px)
    d = rays @ direction
    w = eye - center
    # Nearest points of two lines: the viewing ray and the axis.
    across = np.maximum(np.sin(_MAX_OFF_RAD) ** 2, 1 - d * d)  # of a ray along the axis: the axis may be as far off
    s = (w @ direction - d * (rays @ w)) / across
    t = s * d - rays @ w
    lateral = np.linalg.norm(w + t[:, None] * rays - s[:, None] * direction, axis=1)
    return s, lateral, (t / axis.camera.K[0, 0]) ** 2 / np.sqrt(across)


def _profile(axes: Sequence[MajorAxis], center: Array, direction: Array, body: StandingBody) -> tuple[Array, Array]:
    """Return the mean width of the silhouettes along the axis: the middles of bins and the widths, (n,), metres.

    Arms that are spread farther than the body is broad are left out.
    """
    edges = np.arange(-body.height_m, body.height_m, VOXEL_M)
    widths = []
    for axis in axes:
        s, lateral, areas = _along(axis, center, direction)
        near = lateral < body.half_breadth_m
        # The points are a sample: each stands for as many pixels as it was drawn from.
        share = axis.n_pixels / len(axis.points_px)
        widths.append(np.histogram(s[near], edges, weights=share * areas[near])[0] / VOXEL_M)
    return (edges[1:] + edges[:-1]) / 2, np.median(widths, axis=0)


def _template(body: StandingBody) -> tuple[Array, Array]:
    """Return the widths from a head's length above the crown, where nothing is, to one below the shoulders."""
    below_m, widths_m = body.profile
    own = below_m < body.below_crown_m("left_shoulder") + body.head_m
    above = np.arange(-body.head_m, 0.0, VOXEL_M)
    return (np.append(above, below_m[own]), np.append(np.zeros(len(above)), widths_m[own]))


def _heads(along: Array, widths: Array, body: StandingBody) -> list[tuple[float, float]]:
    """Return where along the axis the top of a head may be, and how far the widths are from the body's, metres.

    These are the minima of the difference, no two of them within a head's length. Trunks may be wider than the body's.
    There is no head where the end of a pillar of even width, within a head's length, fits better.
    """
    from scipy.ndimage import minimum_filter1d  # imported lazily: loading scipy takes 0.2 s

    below_m, expected_m = _template(body)
    order = np.argsort(along)
    places = along[:, None] - below_m
    measured = np.interp(places, along[order], widths[order])
    pillars = np.where(below_m > 0, np.median(measured[:, below_m > 0], axis=1)[:, None], 0.0)
    off = measured - expected_m
    is_trunk = below_m > body.below_crown_m("left_shoulder")
    misfits = np.where(is_trunk, np.maximum(0.0, -off), np.abs(off)).mean(axis=1)
    is_within = (places.min(axis=1) >= along.min()) & (places.max(axis=1) <= along.max())
    of_pillars = np.where(is_within, np.abs(measured - pillars).mean(axis=1), np.inf)
    nearby = minimum_filter1d(of_pillars, 1 + 2 * round(body.head_m / VOXEL_M))
    misfits[~is_within | (misfits >= nearby)] = np.inf
    found: list[tuple[float, float]] = []
    for i in np.argsort(misfits, kind="stable"):
        if np.isfinite(misfits[i]) and all(abs(along[i] - top) > body.head_m for top, _ in found):
            found.append((float(along[i]), float(misfits[i])))
    return found
