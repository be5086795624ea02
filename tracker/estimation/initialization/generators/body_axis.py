"""Find the major axis of a body in space from the axes of its silhouettes, and the head along it (GD96 Sect. 4.1)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.generators.silhouette_axis import MajorAxis
from tracker.geometry.arrays import Array

_MAX_OFF_RAD = np.radians(20)
"""Largest angle between the axis and the plane of a view that agrees with the others."""
_MIN_APART = 0.2
"""Smallest spread of the planes, as a sine: views from opposite sides have the same plane."""
_CENTER_WEIGHT = 0.1
"""Weight of the rays through the silhouettes' centres against the planes. They only give the place along the axis."""
_BIN_M = 0.02
"""Width of the bins along the axis in which the silhouettes' widths are measured, metres."""
_LATERAL_M = 0.40
"""Points of a silhouette farther aside of the axis are not counted, metres."""
_HEAD = ((-0.08, 0.0, 0.0), (0.0, 0.02, 0.065), (0.02, 0.105, 0.100), (0.105, 0.135, 0.080))
"""Nothing, crown, head and neck: begin and end below the top and the width of their silhouettes, as fractions of the
height."""
_SHOULDERS = (0.18, 0.32, 0.16)
"""The same for the trunk below, which may be wider."""
SHOULDERS = 0.185
"""Distance of the shoulders' joint centres below the top of the head, as a fraction of the height (P. de Leva 1996, J.
Biomech. 29:1223)."""
_MAX_MISFIT = 0.035
"""Largest mean difference of the widths from those of a head, as a fraction of the height."""


class BodyAxis(NamedTuple):
    """The major axis of a body."""

    up: Array
    """Unit direction from the legs to the head, (3,)."""
    top: Array
    """Top of the head, on the axis, (3,), metres."""
    misfit: float
    """Mean difference of the widths along the axis from those of a head, as a fraction of the height."""
    views: tuple[MajorAxis, ...]
    """The axes of all views that are used."""
    left_out: tuple[str, ...]
    """Names of views whose axis contradicts the others."""


def find_body_axes(axes: Sequence[MajorAxis], up: Array, height_m: float) -> list[BodyAxis]:
    """Return the axis of a body with each place that may be its head, the best first.

    Args:
        axes: of the silhouettes of one person.
        up: vertical axis of the world, (3,); of two heads that fit alike, the upper one is first.
        height_m: of the person, as far as it is known.

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
        along, widths = _profile(used, center, sign * direction, height_m)
        for top_m, misfit in _heads(along, widths, height_m):
            if misfit <= _MAX_MISFIT:
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
    if spreads[1] < _MIN_APART * spreads[0]:
        return None
    off = max(abs(float(np.arcsin(np.clip(a.normal_world @ directions[2], -1, 1)))) for a in axes)
    return directions[2], off


def _center(axes: Sequence[MajorAxis], direction: Array) -> Array:
    """Return the point nearest to all planes, and along the axis nearest to the rays through the centres, (3,)."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for a in axes:
        eye, normal = a.camera.center_world, a.normal_world
        ray = a.camera.rays(a.lines_px[-1].mean(axis=0))
        M = a.elongation * np.outer(normal, normal) + _CENTER_WEIGHT * (np.eye(3) - np.outer(ray, ray))
        A, b = A + M, b + M @ eye
    return np.asarray(np.linalg.solve(A, b), dtype=np.float64)


def _along(axis: MajorAxis, center: Array, direction: Array) -> tuple[Array, Array, Array]:
    """Return the places of a silhouette's points along the axis, their distances from it, and their areas.

    All are (n,), in metres, the areas in square metres.
    """
    eye = axis.camera.center_world
    rays = axis.camera.rays(axis.points_px)
    d = rays @ direction
    w = eye - center
    # Nearest points of two lines: the viewing ray and the axis.
    s = (w @ direction - d * (rays @ w)) / np.maximum(1e-6, 1 - d * d)
    t = s * d - rays @ w
    lateral = np.linalg.norm(w + t[:, None] * rays - s[:, None] * direction, axis=1)
    tilt = np.sqrt(np.maximum(0.05, 1 - d * d))
    return s, lateral, (t / axis.camera.K[0, 0]) ** 2 / tilt


def _profile(axes: Sequence[MajorAxis], center: Array, direction: Array, height_m: float) -> tuple[Array, Array]:
    """Return the mean width of the silhouettes along the axis: the middles of bins and the widths, (n,), metres."""
    edges = np.arange(-1.2 * height_m, 1.2 * height_m, _BIN_M)
    widths = []
    for axis in axes:
        s, lateral, areas = _along(axis, center, direction)
        near = lateral < _LATERAL_M
        # The points are a sample: each stands for as many pixels as it was drawn from.
        share = axis.n_pixels / len(axis.points_px)
        widths.append(np.histogram(s[near], edges, weights=share * areas[near])[0] / _BIN_M)
    return (edges[1:] + edges[:-1]) / 2, np.median(widths, axis=0)


def _heads(along: Array, widths: Array, height_m: float) -> list[tuple[float, float]]:
    """Return where along the axis the top of a head may be, metres, and how far the widths are from those of a head.

    These are the minima of the difference, no two of them within a head's length.
    """
    relative = widths / height_m
    misfits = np.full(len(along), np.inf)
    a, b, least = _SHOULDERS
    for i, top in enumerate(along):
        below = (top - along) / height_m
        terms = [np.abs(relative[(below > a) & (below <= b)] - width) for a, b, width in _HEAD]
        terms.append(np.maximum(0.0, least - relative[(below > a) & (below <= b)]))
        if all(len(t) for t in terms):
            misfits[i] = np.mean([t.mean() for t in terms])
    found: list[tuple[float, float]] = []
    for i in np.argsort(misfits, kind="stable"):
        if np.isfinite(misfits[i]) and all(abs(along[i] - top) > _HEAD[-1][1] * height_m for top, _ in found):
            found.append((float(along[i]), float(misfits[i])))
    return found
