"""Find keyframes that disagree with the frames around them, by motion and by costs. Nothing changes them.

Find frames whose pose is inconsistent with the neighbouring frames, from the motion alone.

A tracking run may disagree with a keyframe or another run where they meet, so that the body jumps. It jumps too if
the pose of a single frame is wrong. Each step between frames is compared with the steps before and after it:

    off(f) = max over joints of |s(f) - (s(f-1) + s(f+1)) / 2|,  s(f) = p(f+1) - p(f)

This residual is 0 for a steady motion and large for a jump. Hands in everyday and in vigorous motion stay below an
acceleration of 90 m/s^2; a larger one counts as inconsistent.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
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


_MAX_ACCELERATION_M_S2 = 90.0
"""Largest acceleration of hands in everyday and in vigorous motion, m/s^2; see above."""
_THRESHOLDS_M = (0.05, 0.25)
"""Least and largest threshold, metres. Smaller residuals are tracking noise; larger ones are inconsistent at any frame
rate."""


def threshold_m(fps: float) -> float:
    """Return the largest consistent residual of a step at a frame rate, metres."""
    return float(np.clip(_MAX_ACCELERATION_M_S2 / fps**2, *_THRESHOLDS_M))


def motion_residuals_m(points_world: Array) -> Array:
    """Compare each step between consecutive frames with the steps before and after it.

    Args:
        points_world: joints on n consecutive frames, (n, n_points, 3), metres.

    Returns:
        For the step to each frame but the first, the largest residual over the joints, (n - 1,), metres. All 0 for
        fewer than three frames.
    """
    steps = np.diff(points_world, axis=0)
    if len(steps) < 2:
        return np.zeros(len(steps))
    around = np.empty_like(steps)
    around[1:-1] = (steps[:-2] + steps[2:]) / 2
    around[0], around[-1] = steps[1], steps[-2]
    return np.asarray(np.linalg.norm(steps - around, axis=-1).max(axis=-1))


def inconsistent_frames(
    models: Sequence[BodyModel], frames: Sequence[int], values: Array, keyframes: frozenset[int] | set[int], fps: float
) -> list[int]:
    """Find the frames that are inconsistent with their neighbours.

    Args:
        models: the body that each pose was made with.
        frames: frames that have a pose, ascending.
        values: their poses, (n, n_values).
        keyframes: frames set or verified by a person; of two inconsistent frames the other one is reported.
        fps: frame rate, 1/s.

    Returns:
        One frame for each jump, ascending: the later of the two, unless only that one is a keyframe.
    """
    at = np.asarray(frames, dtype=np.int64)
    found: list[int] = []
    for run in np.split(np.arange(len(at)), np.flatnonzero(np.diff(at) != 1) + 1):
        off = (
            motion_residuals_m(np.array([models[i].points_world(values[i]) for i in run]))
            if len(run) > 1
            else np.zeros(0)
        )
        # Half of a jump appears in the neighbouring steps too: only the largest of them counts.
        beside = np.pad(off, 1)
        peaks = (off > threshold_m(fps)) & (off >= beside[:-2]) & (off > beside[2:])
        for i in np.flatnonzero(peaks):
            earlier, later = int(at[run[i]]), int(at[run[i + 1]])
            found.append(earlier if later in keyframes and earlier not in keyframes else later)
    return sorted(set(found))
