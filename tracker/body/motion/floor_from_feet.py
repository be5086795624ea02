"""The floor under the feet of people: the plane through the lowest points of their feet, frame by frame.

On most frames a foot stands on the floor. The lowest point of the feet then lies on it. Frames in the air are few, so
that a plane with least absolute deviations leaves them out. "Lowest" needs a direction that points up: at first it is
that from the feet to the heads, then the normal of the plane.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import MIN_HEIGHT_M, GroundPlane

FOOT_POINTS, HEAD = ("left_heel", "left_toe", "right_heel", "right_toe"), "head"


class FeetFloor(NamedTuple):
    """The floor under the feet."""

    plane: GroundPlane
    spread_m: float
    """Median distance of the feet from it, metres."""
    tilt_deg: float
    """Standard deviation of the angle of its normal about the worst axis, degrees, if errors grow along the places."""
    n_places: int
    """Number of places, a foot's length apart or more, on which feet stood."""


def floor_from_feet(people: Sequence[Mapping[int, PosedBody]]) -> FeetFloor:
    """Fit a plane to the feet of all people.

    Args:
        people: the poses of each person by frame, in bodies with heels and toes.

    Raises:
        TrackerError: a body has no feet, there are no poses, or the feet stood almost on a line.
    """
    feet, heads, length_m = _feet([body for poses in people for body in poses.values()])
    up = heads.mean(axis=0) - feet.mean(axis=(0, 1))
    up /= np.linalg.norm(up)
    plane, lowest = GroundPlane(up, 0.0), feet[:, 0]
    for _ in feet:  # ends as soon as no other point is the lowest one of its frame
        before, lowest = lowest, feet[np.arange(len(feet)), (feet @ plane.normal).argmin(axis=1)]
        plane = _plane_through(lowest, up)
        if np.array_equal(before, lowest):
            break
    off_m = np.abs(lowest @ plane.normal - plane.offset_m)
    spread_m = float(np.median(off_m))
    places = _apart(lowest[off_m <= 3 * spread_m], length_m)
    steps = places - places.mean(axis=0)
    across = np.linalg.svd(steps, full_matrices=False)[2][1]  # the direction in which they spread second most
    width_m = float(np.ptp(steps @ across))
    if width_m < MIN_HEIGHT_M:
        raise TrackerError(
            f"expected feet that stood far from one line, found them within {100 * width_m:.0f} cm of one; set the "
            "floor by three points, or track frames on which people walk to the side"
        )
    # Not divided by the root of their number: soles that are wrong are so on all places of a person.
    tilt_rad = MAD_TO_SIGMA * spread_m / np.std(steps @ across)
    return FeetFloor(plane, spread_m, float(np.degrees(tilt_rad)), len(places))


def _feet(bodies: Sequence[PosedBody]) -> tuple[Array, Array, float]:
    """Return the points of the feet, (n, 4, 3), the heads, (n, 3), and the length of a foot, metres."""
    if not bodies:
        raise TrackerError("expected poses whose feet show the floor, found none; track first")
    points = []
    for body in bodies:
        names = body.model.point_names
        missing = next((n for n in (*FOOT_POINTS, HEAD) if n not in names), None)
        if missing is not None:
            raise TrackerError(
                f"expected bodies with feet, found {body.model.name} without '{missing}'; set the floor by three points"
            )
        points.append(body.points_world[[names.index(n) for n in (*FOOT_POINTS, HEAD)]])
    all_points = np.array(points)
    length_m = np.linalg.norm(all_points[:, 1] - all_points[:, 0], axis=1).mean()
    return all_points[:, :4], all_points[:, 4], float(length_m)


def _plane_through(points: Array, up: Array) -> GroundPlane:
    """Return the plane with the least sum of distances from points, (n, 3), by iterated weighted least squares."""
    weights = np.ones(len(points))
    for _ in range(100):  # it has converged after some ten, but nothing proves that it must
        middle = np.average(points, axis=0, weights=weights)
        normal = np.linalg.svd((points - middle) * np.sqrt(weights)[:, None], full_matrices=False)[2][2]
        before, weights = weights, 1 / np.maximum(np.abs((points - middle) @ normal), 1e-4)  # metres: below any spread
        if np.allclose(before, weights, rtol=0.01):
            break
    normal = normal * np.sign(normal @ up)
    return GroundPlane(normal, float(normal @ middle))


def _apart(points: Array, distance_m: float) -> Array:
    """Return points that lie at least a distance apart, the first of each crowd."""
    kept = points[:1]
    for p in points[1:]:
        if np.linalg.norm(kept - p, axis=1).min() >= distance_m:
            kept = np.vstack([kept, p])
    return kept
