"""Decide who is who where paths of people come near each other, break off and begin.

A path is cut where it may have gone on with somebody else: where it has a gap, and once wherever another path is near.
Each stretch continues the person whose place and traits (sizes, colors) it has most likely, all that begin on a frame
together (the Hungarian method). Both are likelihoods, in nats, and their scales are measured on the paths themselves:
steps have a Cauchy distribution, for detections leap; differences of traits have Student's t, of as many degrees of
freedom as there are stretches that show how much the traits of one person vary.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.compute.quantiles import known_median
from tracker.compute.sampling import without_gaps
from tracker.geometry.arrays import TINY, Array, IntArray, Mask

Bones: TypeAlias = Sequence[tuple[Sequence[int], Sequence[int]]]
"""Indices of the left and of the right point at both ends of each bone."""
SAME_PERSON_M = 0.4
"""Largest distance, metres, from where somebody was some frames before, or is by another observation, of what is seen
of the same person: a person is as wide."""


class PersonPath(NamedTuple):
    """Somebody who is followed by place alone."""

    frames: IntArray
    """Ascending, (n,)."""
    points_world: Array
    """Points of the person, (n, n_points, 3), metres; NaN where unknown."""
    traits: Array
    """By which people differ, (n, n_traits); NaN where unknown."""

    @classmethod
    def of(cls, frames: Sequence[int], points_world: Array, bones: Bones, colors: Array) -> "PersonPath":
        """Return a path with the logarithms of the lengths of bones and the colors as traits.

        Args:
            frames: ascending, (n,).
            points_world: (n, n_points, 3), metres; NaN where unknown.
            bones: see `Bones`.
            colors: of the person in each view, apart from those usual in the view, (n, n_views, n_colors).
        """
        lengths = [np.linalg.norm(points_world[:, a] - points_world[:, b], axis=-1).mean(axis=1) for a, b in bones]
        sizes = np.log(np.array(lengths).reshape(len(bones), len(frames)).T)
        return cls(np.array(frames), points_world, np.hstack([sizes, known_median(np.swapaxes(colors, 0, 1))]))


class _Stretch(NamedTuple):
    """A part of a path that is of one person."""

    path: int
    rows: slice
    frames: IntArray
    points_world: Array
    traits: Array
    """Of the frames on which nobody is near, (m, n_traits)."""


def who_is_who(paths: Sequence[PersonPath], near_m: float) -> list[IntArray]:
    """Return the person of each row of each path, (n,), from 0, in the order in which they appear.

    Args:
        paths: in which no person is twice on a frame.
        near_m: distance of two people below which they may be taken for each other, metres.
    """
    seen = np.unique(np.concatenate([np.empty(0, np.int64), *(p.frames for p in paths)]))
    every = int(np.diff(seen).min()) if len(seen) > 1 else 1  # of footage at a lower rate
    paths = [PersonPath(p.frames // every, _filled(p.points_world), p.traits) for p in paths]
    begins = [np.diff(p.frames, prepend=-2) > 1 for p in paths]
    is_near = [np.zeros(len(p.frames), dtype=bool) for p in paths]
    spans = [(int(p.frames[0]), int(p.frames[-1])) for p in paths]
    for a, b in combinations(range(len(paths)), 2):
        if max(spans[a][0], spans[b][0]) > min(spans[a][1], spans[b][1]):
            continue
        _cut(paths[a], paths[b], near_m, (begins[a], begins[b]), (is_near[a], is_near[b]))
    stretches = []
    for i, (path, starts, near) in enumerate(zip(paths, begins, is_near, strict=True)):
        bounds = [*np.flatnonzero(starts).tolist(), len(starts)]
        for rows in map(slice, bounds[:-1], bounds[1:]):
            own = path.traits[rows][~near[rows]]
            stretches.append(_Stretch(i, rows, path.frames[rows], path.points_world[rows], own))
    out = [np.empty(len(p.frames), dtype=np.int64) for p in paths]
    for person, own in enumerate(_joined(stretches)):
        for stretch in own:
            out[stretch.path][stretch.rows] = person
    return out


def _cut(a: PersonPath, b: PersonPath, near_m: float, begins: tuple[Mask, Mask], is_near: tuple[Mask, Mask]) -> None:
    """Mark the rows of two paths on which they are near, and where they may have been exchanged.

    While they are near, that is once, where an exchange moves them least; and where one of them is lost.
    """
    common, at_a, at_b = np.intersect1d(a.frames, b.frames, return_indices=True)
    A, B = a.points_world[at_a], b.points_world[at_b]
    near = np.flatnonzero(_apart(A, B) < near_m)
    for at, marks in zip((at_a, at_b), is_near, strict=True):
        marks[at[near]] = True
    exchanged = np.full(len(common), np.inf)  # how far an exchange on the way to each frame moves them
    exchanged[1:] = np.where(np.diff(common) == 1, _apart(A[1:], B[:-1]) + _apart(B[1:], A[:-1]), np.inf)
    for run in without_gaps(near):
        ways = np.arange(run[0], min(run[-1] + 2, len(common)))
        best = ways[np.argmin(np.nan_to_num(exchanged[ways], nan=np.inf))]
        if np.isfinite(exchanged[best]):
            begins[0][at_a[best]] = begins[1][at_b[best]] = True
    for k in near.tolist():
        for at, marks, other in ((at_a, begins[0], b), (at_b, begins[1], a)):
            row = at[k] + 1
            if row < len(marks) and common[k] + 1 not in other.frames:
                marks[row] = True


def _joined(stretches: Sequence[_Stretch]) -> list[list[_Stretch]]:
    """Return the stretches of each person."""
    from scipy.optimize import linear_sum_assignment  # imported lazily: it takes a third of a second

    likelihood, people = _Likelihood.of(stretches), list[list[_Stretch]]()
    for first, group in groupby(sorted(stretches, key=lambda s: s.frames[0]), key=lambda s: s.frames[0]):
        begun = list(group)
        free = [own for own in people if own[-1].frames[-1] < first]
        if len(begun) == len(free) == 1:
            free[0] += begun
            continue
        nats = np.array([[likelihood.nats(own, stretch) for own in free] for stretch in begun])
        rows, columns = linear_sum_assignment(nats.reshape(len(begun), len(free)))
        for row, column in zip(rows, columns, strict=True):
            free[column].append(begun[row])
        people += [[stretch] for i, stretch in enumerate(begun) if i not in rows]
    return people


@dataclass(frozen=True, eq=False)
class _Likelihood:
    """How people move and how their traits vary."""

    step_m: float
    """Median distance from one frame to the next."""
    noise: Array
    """Variance of a trait of one person from frame to frame, (n_traits,)."""
    within: Array
    """Variance of a trait of one person between long stretches, (n_traits,)."""
    among: Array
    """Variance of a trait of all people, (n_traits,)."""
    freedom: Array
    """Degrees of freedom of these variances, (n_traits,)."""

    @classmethod
    def of(cls, stretches: Sequence[_Stretch]) -> "_Likelihood":
        """Measure it; halves of stretches show how the traits of one person vary."""
        steps = [_apart(s.points_world[1:], s.points_world[:-1]) for s in stretches if len(s.frames) > 1]
        step_m = float(known_median(np.concatenate([np.empty(0), *steps])))
        known = [s.traits for s in stretches if len(s.traits) > 1]
        if not known:
            one = np.ones(stretches[0].traits.shape[1] if stretches else 0)
            return cls(_positive(step_m), one, one, one, one)
        noise = np.nan_to_num(known_median(np.concatenate([np.diff(t, axis=0) for t in known]) ** 2))
        halves = np.array([known_median(t[: len(t) // 2]) - known_median(t[len(t) // 2 :]) for t in known])
        medians, weights = np.array([known_median(t) for t in known]), np.array([[len(t)] for t in known], dtype=float)
        weights = np.where(np.isfinite(halves) & np.isfinite(medians), weights, 0.0)
        total = np.maximum(weights.sum(axis=0), 1.0)
        within = (weights * np.nan_to_num(halves) ** 2).sum(axis=0) / total / 2
        mean = (weights * np.nan_to_num(medians)).sum(axis=0) / total
        among = (weights * (np.nan_to_num(medians) - mean) ** 2).sum(axis=0) / total
        freedom = np.maximum(total**2 / np.maximum((weights**2).sum(axis=0), 1.0), 1.0)
        within = np.maximum(within, TINY)
        return cls(_positive(step_m), noise, within, np.maximum(within, among), freedom)

    def nats(self, person: Sequence[_Stretch], stretch: _Stretch) -> float:
        """Return the negative log likelihood that a stretch continues a person, apart from a constant."""
        before = person[-1]
        scale_m = self.step_m * float(stretch.frames[0] - before.frames[-1])
        apart_m = float(np.nan_to_num(_apart(before.points_world[-1:], stretch.points_world[:1])[0], nan=scale_m))
        place = 2 * np.log1p((apart_m / scale_m) ** 2) + 3 * np.log(scale_m)
        known = np.concatenate([s.traits for s in person])
        off = known_median(known) - known_median(stretch.traits)
        noise = self.noise * (1 / max(len(known), 1) + 1 / max(len(stretch.traits), 1))
        same, other = (self._surprise(off, 2 * variance + noise) for variance in (self.within, self.among))
        return float(place + np.nansum(same - other))

    def _surprise(self, off: Array, variance: Array) -> Array:
        """Return the negative logarithm of Student's t, apart from a constant."""
        return 0.5 * np.log(variance) + (self.freedom + 1) / 2 * np.log1p(off**2 / (self.freedom * variance))


def _filled(points: Array) -> Array:
    """Return the last known place of each point on each frame, (n, n_points, 3), metres; NaN where never known."""
    known = np.isfinite(points).all(axis=-1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(points))[:, None], 0), axis=0)
    return np.take_along_axis(points, last[..., None], axis=0)


def _positive(step_m: float) -> float:
    return max(step_m, TINY) if np.isfinite(step_m) else 1.0


def _apart(one: Array, other: Array) -> Array:
    """Return the median distance of the points of two people on some frames, (n, n_points, 3) each, (n,), metres."""
    return known_median(np.linalg.norm(one - other, axis=-1).T)
