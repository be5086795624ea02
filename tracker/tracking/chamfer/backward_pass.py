"""A second pass over what tracking lost: back from the first trusted poses after it.

A limb that is lost in fast motion is found again where the motion slows down. Followed back from there it is often
found in frames in which it was lost; where it is lost the other way round too, both passes are seldom wrong in the same
frames. What both found is carried to the frames around, and which poses are kept is chosen over the whole stretch
(`ways`).
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import ContourMatch
from tracker.fitting.gauss_newton import held
from tracker.fitting.interpenetration import KeepBodiesApart
from tracker.geometry.arrays import Array
from tracker.tracking.chamfer.frame_estimator import Scene
from tracker.tracking.chamfer.pose_paths import ROUNDS, Candidates, Sight, carry, cheapest_way
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import summed_up, track_chamfer
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.person_memory import Memory
from tracker.tracking.view_regions import regions, visible_outline

_TRUSTED = 3
"""So many good frames in a row end a stretch; fewer may be a lost limb that looks well by chance."""
_MOTION_FRAMES = 3
"""Poses after the stretch from which its motion is known."""
_VISITS = 1 + 2 * ROUNDS
"""How often the second pass comes to each frame."""
_SEEN_AT_ONCE = 32
"""Frames whose evidence is kept while poses are carried through a stretch: some megabytes each."""


class Tracked(NamedTuple):
    """What the second pass needs to know of a frame that was tracked."""

    frame: int
    poses: tuple[Array, ...]
    """Of each person, (n_values,) each."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""
    others: tuple[tuple[Array, ...], ...] = ()
    """Of each person poses that are about as good, (n_values,) each; empty where that is not known of anybody."""

    @classmethod
    def of(cls, estimate: PoseEstimate) -> "Tracked":
        """What is needed of an estimate, which holds much more."""
        others = tuple(tuple(other.values for other in of_one) for of_one in estimate.alternatives)
        return cls(estimate.frame, estimate.poses, estimate.statuses, others)


class Followed(NamedTuple):
    """A step of the second pass: one frame of a stretch, come to once."""

    frame: int
    person: int
    done: int
    """Steps so far."""
    total: int
    """All steps, of all people: each frame is followed back once, and come to again as poses are carried through."""
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
    total, done = _VISITS * sum(len(s.frames) for s in work), 0
    for stretch in work:
        person, back, last = stretch.person, list[PoseEstimate](), done + _VISITS * len(stretch.frames)
        for estimate in _back(observer, models, known, stretch, settings, free):
            back.append(estimate)
            done += 1
            yield Followed(estimate.frame, person, done, total)
        back.reverse()
        choice = _Choice(observer, models, known, stretch, back, settings, None if free is None else free[person])
        for i in choice.carried():
            done += 1
            if done < last:
                yield Followed(back[i].frame, person, done, total)
        better = choice.better()
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


class _Choice:
    """The poses that one person may have in a stretch, and which of them are kept."""

    def __init__(
        self, observer: Observer, models: Sequence[BodyModel], found: Sequence[Tracked], stretch: _Stretch,
        back: Sequence[PoseEstimate], settings: TrackSettings, free: NDArray[np.bool_] | None,
    ) -> None:  # fmt: skip
        """Begin with what both passes found: `found` on all frames, `back` on those of the stretch, in order."""
        self._observer, self._models, self._settings, self._free = observer, models, settings, free
        self._person, (first, end) = stretch.person, (stretch.frames.start, stretch.frames.stop)
        self._before, self._after = found[max(0, first - 2) : first], found[end : end + 2]
        self._found, self._back = found[first:end], back
        self._model = models[self._person]
        self._known: PartColors | None = None
        for good in (*self._before[-1:], self._after[0]):
            self._known = _colors(observer, models, good, self._person).learn(self._known, 0.5)
        self._options = [self._options_of(f, Tracked.of(b)) for f, b in zip(self._found, back, strict=True)]
        self._views = lru_cache(_SEEN_AT_ONCE)(self._observed)
        self._sight = lru_cache(_SEEN_AT_ONCE)(self._look)

    def _options_of(self, *passes: Tracked) -> Candidates:
        p = self._person
        others = [v for e in passes if e.others for v in e.others[p]]
        return Candidates(self._model, [e.poses[p] for e in passes], others)

    def carried(self) -> Iterator[int]:
        """Carry the poses through the stretch; the index of each frame that was come to."""
        locked = self._found[0].poses[self._person]
        ends = [e[i].poses[self._person] if e else None for e, i in ((self._before, -1), (self._after, 0))]
        ends = [None if e is None else held(self._model, e, locked, self._free) for e in ends]
        yield from carry(self._options, self._sight, ends)

    def better(self) -> tuple[PoseEstimate, ...]:
        """What takes the place of what was found, in the order of tracking: what lies on the cheapest way."""
        ends = [[self._model.points_world(e.poses[self._person]) for e in some] for some in (self._before, self._after)]
        points, costs = [np.array(o.points) for o in self._options], [np.array(o.costs) for o in self._options]
        way, out = cheapest_way(points, costs, *ends), []
        for i, taken in enumerate(way):
            if taken == 1:
                out.append(self._in_place_of(i, self._back[i], f"followed back from frame {self._after[0].frame}"))
            elif taken > 1:
                out.append(self._in_place_of(i, self._judged(i, taken), "carried over from frames around it"))
        return tuple(out)

    def _bodies(self, i: int, values: Array) -> list[PosedBody]:
        """Everybody on a frame of the stretch, the person in a pose, (n_values,)."""
        poses = [values if p == self._person else v for p, v in enumerate(self._found[i].poses)]
        return [PosedBody(m, p) for m, p in zip(self._models, poses, strict=True)]

    def _look(self, i: int) -> Sight:
        person, settings = self._person, self._settings
        bodies, views = self._bodies(i, self._found[i].poses[person]), self._views(i)
        match = ContourMatch(views, bodies, person, settings.match, settings.theta_px, everywhere=True)
        apart = [KeepBodiesApart(bodies, person, settings.apart)] if len(bodies) > 1 and settings.apart > 0 else []
        return Sight(self._model, match, Colors(views, bodies, person), self._known, apart, settings, self._free)

    def _observed(self, i: int) -> tuple[ViewEvidence, ...]:
        """The evidence of a frame around what both passes found there, by which all poses are judged."""
        cameras = self._observer.matched_cameras
        guesses = [self._bodies(i, e.poses[self._person]) for e in (self._found[i], self._back[i])]
        outlines = [np.concatenate([visible_outline(g, c) for g in guesses]) for c in cameras]
        where = regions(cameras, [body for g in guesses for body in g])
        return self._observer.evidence(self._found[i].frame, where, outlines if self._settings.segments else None)

    def _judged(self, i: int, taken: int) -> PoseEstimate:
        """What is told of a pose that was carried to a frame."""
        options, views = self._options[i], self._views(i)
        poses = [b.values for b in self._bodies(i, options.poses[taken])]
        memories = [Memory(m, v, alone=len(poses) == 1) for m, v in zip(self._models, poses, strict=True)]
        memories[self._person].known = self._known
        scene = Scene(views, memories, poses, self._settings)
        people = range(len(poses))
        found = [scene.judged(p, options.rivals(taken)) if p == self._person else scene.held(p) for p in people]
        return summed_up(self._found[i].frame, views, self._models, poses, found, self._settings)

    def _in_place_of(self, i: int, estimate: PoseEstimate, remark: str) -> PoseEstimate:
        """An estimate with a remark on the person; of the others, who were held, as sure as before."""
        person, statuses, remarks = self._person, list(self._found[i].statuses), list(estimate.remarks)
        statuses[person] = estimate.statuses[person]
        remarks[person] = ", ".join(filter(None, (remarks[person], remark)))
        return estimate._replace(statuses=tuple(statuses), remarks=tuple(remarks))


def _bodies(models: Sequence[BodyModel], poses: Sequence[Array]) -> list[PosedBody]:
    return [PosedBody(m, p) for m, p in zip(models, poses, strict=True)]


def _colors(observer: Observer, models: Sequence[BodyModel], where: Tracked, person: int) -> Colors:
    """The colours under a person on a frame on which they were not lost."""
    bodies = _bodies(models, where.poses)
    return Colors(observer.evidence(where.frame, regions(observer.matched_cameras, bodies)), bodies, person)
