"""A second pass over what tracking lost: back from the first trusted poses after it.

A limb that is lost in fast motion is found again where the motion slows down. Followed back from there it is often
found in frames in which it was lost; where it is lost the other way round too, both passes are seldom wrong in the same
frames. Which poses are kept is chosen over the whole stretch, as the cheapest way through the two passes (A. Viterbi
1967, IEEE Trans. Inf. Theory 13:260): what single frames leave open, the frames before and after tell.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.apart import KeepBodiesApart
from tracker.appearance import Colors, PartColors
from tracker.body import Body, BodyModel
from tracker.confidence import Status
from tracker.evidence import Observer
from tracker.fit import Block, held
from tracker.recover import LEAST_GAIN
from tracker.refine import ContourMatch
from tracker.rigid import Array
from tracker.surroundings import regions, visible_outline
from tracker.track import PoseEstimate, track_chamfer
from tracker.track_settings import TrackSettings, prior_blocks

_TRUSTED = 3
"""So many good frames in a row end a stretch; fewer may be a lost limb that looks well by chance."""
_MOTION_FRAMES = 3
"""Poses after the stretch from which its motion is known."""
_SAME_M = 0.01
"""Poses of which no point differs by more are the same, metres."""
_MOVED_M = 0.5
"""What a point moves from frame to frame (one standard deviation), metres: far, as points of a limb move together."""


class Tracked(NamedTuple):
    """What the second pass needs to know of a frame that was tracked."""

    frame: int
    poses: tuple[Array, ...]
    """Of each person, (n_values,) each."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""

    @classmethod
    def of(cls, estimate: PoseEstimate) -> "Tracked":
        """What is needed of an estimate, which holds much more."""
        return cls(estimate.frame, estimate.poses, estimate.statuses)


class Followed(NamedTuple):
    """A step of the second pass: one frame of a stretch, followed back."""

    frame: int
    person: int
    done: int
    """Frames followed back so far."""
    total: int
    """Frames to follow back, of all people."""
    better: tuple[PoseEstimate, ...] = ()
    """At the end of a stretch, in the order of tracking: what takes the place of what was found. It differs in this
    person alone; the others' poses and statuses are those that were found."""


class _Stretch(NamedTuple):
    """Frames in which somebody was lost, and the one from which they are followed back."""

    person: int
    frames: range
    """Indices into the frames tracked; the one after the last is where the way back begins."""


def stretches(statuses: Sequence[Status], given: Sequence[bool]) -> list[range]:
    """Where one person was lost: the indices of neighbouring frames of which the first and the last are not good.

    A few good frames between two stretches join them, but a pose that was given never is in one.

    Args:
        statuses: of the person, frame by frame, in the order of tracking.
        given: whether a person said so, likewise.
    """
    out: list[range] = []
    for i in (i for i, status in enumerate(statuses) if status != "good" and not given[i]):
        if out and i - out[-1].stop < _TRUSTED and not any(given[out[-1].stop : i]):
            out[-1] = range(out[-1].start, i + 1)
        else:
            out.append(range(i, i + 1))
    return [r for r in out if any(statuses[i] == "lost" for i in r)]


def follow_back(
    observer: Observer,
    models: Sequence[BodyModel],
    found: Sequence[Tracked],
    settings: TrackSettings,
    fixed: Mapping[int, Mapping[int, Array]] | None = None,
    people: Sequence[int] | None = None,
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[Followed]:
    """Follow people back through the frames in which they were lost, one after the other; the others stay as found.

    Where nobody was lost there is nothing to do, and nothing is looked at. Arguments as of `track_chamfer`, but for

    Args:
        observer: gives the evidence of a frame.
        models: the body of each person.
        found: what was tracked, in the order of tracking.
        settings: of the tracker.
        fixed: poses that stay as they are (keyframes), by frame and person.
        people: whom to track; everybody by default.
        free: of each person the degrees of freedom that may move, (n_dofs,); all by default. The others stay as they
            were found.

    Yields:
        A step for each frame; the last of a stretch with the poses that are better.
    """
    everybody = range(len(models)) if people is None else people
    known, keyframes = list(found), fixed or {}
    work = [s for person in everybody for s in _to_follow(known, person, keyframes)]
    work.sort(key=lambda s: s.frames.stop)
    total, done = sum(len(s.frames) for s in work), 0
    for stretch in work:
        person, back = stretch.person, list[PoseEstimate]()
        for estimate in _back(observer, models, known, stretch, settings, free):
            back.append(estimate)
            done += 1
            if len(back) < len(stretch.frames):
                yield Followed(estimate.frame, person, done, total)
        back.reverse()
        better = _better(observer, models, known, stretch, back, settings)
        at = {f.frame: i for i, f in enumerate(known)}
        for estimate in better:
            known[at[estimate.frame]] = Tracked.of(estimate)
        yield Followed(back[0].frame, person, done, total, better)


def _to_follow(found: Sequence[Tracked], person: int, fixed: Mapping[int, Mapping[int, Array]]) -> list[_Stretch]:
    """The stretches of one person that end where they can be followed back from."""
    statuses = [f.statuses[person] for f in found]
    out = []
    for frames in stretches(statuses, [person in fixed.get(f.frame, {}) for f in found]):
        end = frames.stop
        if end == len(found):  # nothing after it is trusted: from the last frame that is not lost
            end = max((i for i in frames if statuses[i] != "lost"), default=frames.start)
        if end > frames.start:
            out.append(_Stretch(person, range(frames.start, end)))
    return out


def _back(
    observer: Observer, models: Sequence[BodyModel], found: Sequence[Tracked], stretch: _Stretch,
    settings: TrackSettings, free: Sequence[NDArray[np.bool_]] | None,
) -> Iterator[PoseEstimate]:  # fmt: skip
    """Track one person from the frame after a stretch to its first; the others stay as they were found."""
    person, (first, end) = stretch.person, (stretch.frames.start, stretch.frames.stop)
    after = takewhile(lambda f: f.statuses[person] == "good", found[end + 1 : end + 1 + _MOTION_FRAMES])
    ahead = [*reversed(list(after)), found[end]]
    start = [[f.poses[p] for f in ahead] for p in range(len(models))]
    given = {f.frame: {p: v for p, v in enumerate(f.poses) if p != person} for f in found[first : end + 1]}
    # What is locked goes on from there as it was found in the stretch.
    locked = None if free is None else free[person]
    given[found[end].frame][person] = held(models[person], found[end].poses[person], found[first].poses[person], locked)
    frames = [f.frame for f in reversed(found[first : end + 1])]
    tracked = track_chamfer(observer, models, start, frames, settings, given, [person], free)
    next(tracked)  # where the way back begins
    return tracked


def _better(
    observer: Observer, models: Sequence[BodyModel], found: Sequence[Tracked], stretch: _Stretch,
    back: Sequence[PoseEstimate], settings: TrackSettings,
) -> tuple[PoseEstimate, ...]:  # fmt: skip
    """What of the way back is kept, in the order of tracking: what lies on the cheapest way through both passes."""
    person, (first, end) = stretch.person, (stretch.frames.start, stretch.frames.stop)
    model, passes = models[person], (found[first:end], back)
    ends = (found[first - 1] if first > 0 else None), found[end]
    known: PartColors | None = None
    for good in ends:
        if good is not None:
            known = _colors(observer, models, good, person).learn(known, 0.5)
    costs = np.array([_costs(observer, models, both, person, known, settings) for both in zip(*passes, strict=True)])
    ways = [[p[i].poses[person] for p in passes] for i in range(len(back))]
    way = cheapest_way(model, ways, costs, tuple(None if e is None else e.poses[person] for e in ends))
    remark = f"followed back from frame {found[end].frame}"
    chosen = zip(passes[0], back, way, strict=True)
    return tuple(_in_place_of(before, estimate, person, remark) for before, estimate, taken in chosen if taken)


def cheapest_way(
    model: BodyModel, poses: Sequence[Sequence[Array]], costs: Array, ends: Sequence[Array | None]
) -> list[int]:
    """Which of several poses is taken on each frame: those that cost and move the least in all.

    Args:
        model: the body.
        poses: of each frame the poses to choose from, (n_values,) each; as many on every frame.
        costs: what each costs on its frame, (n_frames, n_poses), nats.
        ends: the poses before the first frame and after the last, (n_values,) each; None where there is none.

    Returns:
        The index of the pose of each frame; 0 throughout unless others are cheaper by far.
    """
    points = np.array([[model.points_world(v) for v in of_frame] for of_frame in poses])
    before, after = (None if e is None else model.points_world(e) for e in ends)
    total, came = costs[0] + _moved(before, points[0]), []
    for now, then, cost in zip(points[1:], points, costs[1:], strict=False):
        ways = total + np.array([_moved(x, then) for x in now])  # (to, from)
        came.append(ways.argmin(axis=1))
        total = cost + ways.min(axis=1)
    total = total + _moved(after, points[-1])
    stay = float(costs[:, 0].sum() + _moved(before, points[0])[0] + _moved(after, points[-1])[0])
    stay += sum(float(_moved(b[0], a[:1])[0]) for a, b in pairwise(points))
    if stay - total.min() < LEAST_GAIN:
        return [0] * len(points)
    way = [int(total.argmin())]
    for step in reversed(came):
        way.append(int(step[way[-1]]))
    return way[::-1]


def _moved(one: Array | None, others: Array) -> Array:
    """What it costs to go from a pose to others, points (n, 3) and (m, n, 3) in the world; (m,), nats."""
    return np.zeros(len(others)) if one is None else np.sum((others - one) ** 2, axis=(1, 2)) / (2 * _MOVED_M**2)


def _in_place_of(before: Tracked, estimate: PoseEstimate, person: int, remark: str) -> PoseEstimate:
    """An estimate with a remark on a person; of the others, who were held, as sure as before."""
    statuses, remarks = list(before.statuses), list(estimate.remarks)
    statuses[person] = estimate.statuses[person]
    remarks[person] = ", ".join(filter(None, (remarks[person], remark)))
    return estimate._replace(statuses=tuple(statuses), remarks=tuple(remarks))


def _bodies(models: Sequence[BodyModel], poses: Sequence[Array]) -> list[Body]:
    return [Body(m, p) for m, p in zip(models, poses, strict=True)]


def _colors(observer: Observer, models: Sequence[BodyModel], where: Tracked, person: int) -> Colors:
    """The colours under a person on a frame on which they were not lost."""
    bodies = _bodies(models, where.poses)
    return Colors(observer.evidence(where.frame, regions(observer.matched_cameras, bodies)), bodies, person)


def _costs(
    observer: Observer, models: Sequence[BodyModel], both: Sequence[Tracked | PoseEstimate], person: int,
    known: PartColors | None, settings: TrackSettings,
) -> list[float]:  # fmt: skip
    """What one person's poses of a frame cost, judged by the same evidence; nothing where they are the same."""
    one, other = (models[person].points_world(e.poses[person]) for e in both)
    if np.linalg.norm(one - other, axis=1).max() < _SAME_M:
        return [0.0] * len(both)
    cameras, guesses = observer.matched_cameras, [_bodies(models, e.poses) for e in both]
    outlines = [np.concatenate([visible_outline(g, c) for g in guesses]) for c in cameras]
    where = regions(cameras, [body for g in guesses for body in g])
    views = observer.evidence(both[0].frame, where, outlines if settings.segments else None)
    costs = []
    for bodies in guesses:
        model, values = models[person], bodies[person].values
        match = ContourMatch(views, bodies, person, settings.match, settings.theta_px, everywhere=True)
        priors: list[Block] = prior_blocks(model, values, np.ones(model.n_dofs))
        if len(models) > 1 and settings.apart > 0:
            priors.append(KeepBodiesApart(bodies, person, settings.apart))
        kinematics = model.kinematics(values)
        cost = float(match.costs(values[None])[0]) + sum(b.normal(model, values, kinematics).cost for b in priors)
        if settings.recover is not None and known is not None:
            cost -= settings.recover.colors * float(Colors(views, bodies, person).nats(values[None], known)[0])
        costs.append(cost)
    return costs
