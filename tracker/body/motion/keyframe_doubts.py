"""Find keyframes that disagree with the frames around them, by motion and by costs. Nothing changes them."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.motion.consistency import threshold_m
from tracker.geometry.arrays import Array

_RAISED = 2.0
"""Cost of a view, in the usual one around the frame, from which the view contradicts a keyframe. Poses that are right
stay below 1.8 times on 99 of 100 frames of two recordings, because a page scores without the tracker's choice of edges.
A leg that is 30 cm off has 2.1 and more, an arm 23 cm off 1.9 to 2.3."""
_RAISED_PX = 1.0
"""The cost must also exceed the usual one by so much, px: small costs vary by large factors."""
_MIN_USUAL = 5
"""Fewest frames around a keyframe that make a usual cost."""


class NeighbourGap(NamedTuple):
    """Distance of a keyframe's pose from the motion of its neighbours."""

    distance_m: float
    """Largest over the points of the body."""
    point: int
    """Index of that point."""


class RaisedView(NamedTuple):
    """A view whose cost contradicts a keyframe."""

    camera: int
    """Index of the view."""
    cost_px: float
    usual_px: float
    """Median over the frames around the keyframe."""


def neighbour_gaps(
    places_world: Mapping[int, Array], keyframes: Collection[int], fps: float
) -> dict[int, NeighbourGap]:
    """Return the keyframes that their neighbours contradict, while the neighbours agree with one another.

    With two neighbours p on either side, the place of a keyframe is predicted by the cubic through them,
    (4 (p(-1) + p(1)) - p(-2) - p(2)) / 6. A keyframe is no party to a jump between its neighbours themselves.

    Args:
        places_world: points of the body by frame, (n_points, 3), metres.
        keyframes: the frames to judge.
        fps: frame rate, 1/s.
    """
    limit_m, found = threshold_m(fps), dict[int, NeighbourGap]()
    for frame in sorted(keyframes):
        around = [places_world.get(frame + step) for step in (-2, -1, 1, 2)]
        if frame not in places_world or any(p is None for p in around):
            continue
        before2, before, after, after2 = np.array(around)
        across = (after - before) / 2 - ((before - before2) + (after2 - after)) / 2
        if _farthest(across)[0] > limit_m:
            continue
        gap = _farthest(places_world[frame] - (4 * (before + after) - before2 - after2) / 6)
        if gap.distance_m > limit_m:
            found[frame] = gap
    return found


def raised_views(
    costs_px: Sequence[float | None], others_px: Sequence[Sequence[float | None]]
) -> tuple[RaisedView, ...]:
    """Return the views whose cost contradicts a keyframe, most raised first.

    Args:
        costs_px: cost of each view on the keyframe, (n_views,); None without edges.
        others_px: the same on the frames around it that are not in doubt, (n, n_views).
    """
    raised = list[RaisedView]()
    for camera, cost_px in enumerate(costs_px):
        known = [row[camera] for row in others_px if camera < len(row)]
        usual = [px for px in known if px is not None]
        if cost_px is None or len(usual) < _MIN_USUAL:
            continue
        usual_px = float(np.median(usual))
        if cost_px > _RAISED * usual_px and cost_px > usual_px + _RAISED_PX:
            raised.append(RaisedView(camera, cost_px, usual_px))
    return tuple(sorted(raised, key=lambda view: view.usual_px / view.cost_px))


def _farthest(offsets: Array) -> NeighbourGap:
    """Return the longest of some offsets, (n, 3), metres."""
    lengths = np.linalg.norm(offsets, axis=-1)
    return NeighbourGap(float(lengths.max()), int(lengths.argmax()))
