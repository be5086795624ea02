"""Find points whose depth no view has shown: they were placed by hand in opposite or neighbouring views alone.

A view along the unit vector d determines the position of a point across d: its information is I - d d^T. The sum over
the views of a point has a weakest direction. Its standard deviation, in that of the best known direction, is

    r = sqrt(largest eigenvalue / smallest eigenvalue).

For two views whose lines of sight meet at an angle a it is 1 / sin(a / 2), for opposite views infinite.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import Camera

_MAX_RATIO = 2.0
"""Largest r at which the depth counts as shown. A hand that aims at 3 px is right to some 3 cm in a room, then to 6 cm
in depth: more than half the thickness of an arm. Opposite cameras under a ceiling, which look down by 23 degrees, have
2.5; neighbours on a ring of eight, 45 degrees apart, 2.6."""
_ACROSS = 0.5
"""Smallest share of a view's information on the weakest direction at which it looks across: from 45 degrees on."""


class UndeterminedDepth(NamedTuple):
    """Points whose depth no view has shown, and the view that shows it best."""

    points: tuple[str, ...]
    """Their names, the one asked for first."""
    camera: int
    """Index of the view that looks across the weakest direction of the first of them."""


def undetermined_depth(
    places_world: Mapping[str, Array], seen_by: Mapping[str, Sequence[int]], cameras: Sequence[Camera], point: str
) -> UndeterminedDepth | None:
    """Return the points whose depth no view has shown, if a given one is among them.

    Args:
        places_world: position of each placed point, (3,), metres.
        seen_by: indices of the views in which each point was placed.
        cameras: all views.
        point: name of the point asked for.

    Returns:
        None if the views have shown its depth, or if no other view that has it in the image looks across.
    """
    ways = {name: _weakest(at, seen_by[name], cameras) for name, at in places_world.items()}
    unseen = {name: way for name, way in ways.items() if way is not None}
    if point not in unseen:
        return None
    at, way = places_world[point], unseen[point]
    # The share of the information on the weakest direction that each view would add.
    shares = [1.0 - float(_sight(c, at) @ way) ** 2 if _is_inside(c, at) else 0.0 for c in cameras]
    best = int(np.argmax(shares))
    if shares[best] < _ACROSS:
        return None
    return UndeterminedDepth((point, *(name for name in unseen if name != point)), best)


def _weakest(at: Array, views: Sequence[int], cameras: Sequence[Camera]) -> Array | None:
    """Return the direction, (3,), in which views hardly determine a point; None if they determine all."""
    sights = np.array([_sight(cameras[i], at) for i in set(views)]).reshape(-1, 3)
    information = len(sights) * np.eye(3) - sights.T @ sights
    values, directions = np.linalg.eigh(information)
    return np.asarray(directions[:, 0]) if values[2] > _MAX_RATIO**2 * values[0] else None


def _sight(camera: Camera, at: Array) -> Array:
    way = at - camera.center_world
    return np.asarray(way / max(TINY, float(np.linalg.norm(way))))


def _is_inside(camera: Camera, at: Array) -> bool:
    return bool(camera.is_filmed(camera.pinhole.project(at)))
