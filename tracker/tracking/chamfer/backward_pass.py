"""A second pass over what tracking lost: back from the first trusted poses after it.

A limb that is lost in fast motion is found again where the motion slows down. Followed back from there it is often
found in frames in which it was lost; where it is lost the other way round too, both passes are seldom wrong in the same
frames. What both found is carried to the frames around, and which poses are kept is chosen over the whole stretch
(`ways`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.contour_residuals import ContourResiduals
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.fitting.interpenetration import BodyPenetration
from tracker.geometry.arrays import Array
from tracker.tracking.chamfer.forward_pass import summed_up, track_forward
from tracker.tracking.chamfer.frame_estimator import Scene
from tracker.tracking.chamfer.pose_paths import ROUNDS, Candidates, Sight, carry, cheapest_way
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import BackwardStep, PoseEstimate, TrackedFrame
from tracker.tracking.person_memory import Memory
from tracker.tracking.subjects import Keyframes
from tracker.tracking.tracker import TrackingRun
from tracker.tracking.view_regions import regions, visible_outline

_TRUSTED = 3
"""So many good frames in a row end a stretch; fewer may be a lost limb that looks well by chance."""
_MOTION_FRAMES = 3
"""Poses after the stretch from which its motion is known."""
_VISITS = 1 + 2 * ROUNDS
"""How often the second pass comes to each frame."""
_SEEN_AT_ONCE = 32
"""Frames whose evidence is kept while poses are carried through a stretch: some megabytes each."""


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


def track_lost_backward(
    run: TrackingRun, tracked: Sequence[TrackedFrame], settings: TrackSettings
) -> Iterator[BackwardStep]:
    """Track people back through the frames in which they were lost, one after the other; the others stay as found.

    Where nobody was lost there is nothing to do, and no frame is read.

    Args:
        run: gives the observer and the subjects.
        tracked: all frames, in the order of tracking.
        settings: of the tracker.

    Yields:
        A step for each visit to a frame; the last of an interval with the estimates that are better.
    """
    known, subjects = list(tracked), run.subjects
    work = [s for person in subjects.tracked for s in _to_follow(known, person, subjects.keyframes)]
    work.sort(key=lambda s: s.frames.stop)
    total, done = _VISITS * sum(len(s.frames) for s in work), 0
    for stretch in work:
        person, back, last = stretch.person, list[PoseEstimate](), done + _VISITS * len(stretch.frames)
        for estimate in _back(run, known, stretch, settings):
            back.append(estimate)
            done += 1
            yield BackwardStep(estimate.frame, person, done, total)
        back.reverse()
        choice = _Choice(run, known, stretch, back, settings)
        for i in choice.carried():
            done += 1
            if done < last:
                yield BackwardStep(back[i].frame, person, done, total)
        better = choice.better()
        at = {f.frame: i for i, f in enumerate(known)}
        for estimate in better:
            known[at[estimate.frame]] = TrackedFrame.of(estimate)
        yield BackwardStep(back[0].frame, person, done, total, better)


def _to_follow(found: Sequence[TrackedFrame], person: int, keyframes: Keyframes) -> list[_Stretch]:
    """The stretches of one person that end where they can be followed back from."""
    statuses = [f.statuses[person] for f in found]
    out = []
    for frames in stretches(statuses, [person in keyframes.get(f.frame, {}) for f in found]):
        end = frames.stop
        if end == len(found):  # nothing after it is trusted: from the last frame that is not lost
            end = max((i for i in frames if statuses[i] != "lost"), default=frames.start)
        if end > frames.start:
            out.append(_Stretch(person, range(frames.start, end)))
    return out


def _back(
    run: TrackingRun, found: Sequence[TrackedFrame], stretch: _Stretch, settings: TrackSettings
) -> Iterator[PoseEstimate]:
    """Track one person from the frame after a stretch to its first; the others stay as they were found."""
    subjects, person, (first, end) = run.subjects, stretch.person, (stretch.frames.start, stretch.frames.stop)
    after = takewhile(lambda f: f.statuses[person] == "good", found[end + 1 : end + 1 + _MOTION_FRAMES])
    ahead = [*reversed(list(after)), found[end]]
    start = [[f.poses[p] for f in ahead] for p in range(len(subjects.models))]
    given = {f.frame: {p: v for p, v in enumerate(f.poses) if p != person} for f in found[first : end + 1]}
    # What is locked goes on from there as it was found in the stretch.
    given[found[end].frame][person] = with_locked_dofs(
        subjects.models[person], found[end].poses[person], found[first].poses[person], subjects.active_dofs[person]
    )
    frames = [f.frame for f in reversed(found[first : end + 1])]
    alone = replace(subjects, tracked=(person,), keyframes=given)
    tracked = track_forward(TrackingRun(run.observer, alone, start, frames), settings)
    next(tracked)  # where the way back begins
    return tracked


class _Choice:
    """The poses that one person may have in a stretch, and which of them are kept."""

    def __init__(
        self, run: TrackingRun, found: Sequence[TrackedFrame], stretch: _Stretch, back: Sequence[PoseEstimate],
        settings: TrackSettings,
    ) -> None:  # fmt: skip
        """Begin with what both passes found: `found` on all frames, `back` on those of the stretch, in order."""
        self._observer, self._models, self._settings = run.observer, run.subjects.models, settings
        self._free = run.subjects.active_dofs[stretch.person]
        self._person, (first, end) = stretch.person, (stretch.frames.start, stretch.frames.stop)
        self._before, self._after = found[max(0, first - 2) : first], found[end : end + 2]
        self._found, self._back = found[first:end], back
        self._model = self._models[self._person]
        self._known: PartColors | None = None
        for good in (*self._before[-1:], self._after[0]):
            self._known = _colors(self._observer, self._models, good, self._person).learn(self._known, 0.5)
        self._options = [self._options_of(f, TrackedFrame.of(b)) for f, b in zip(self._found, back, strict=True)]
        self._views = lru_cache(_SEEN_AT_ONCE)(self._observed)
        self._sight = lru_cache(_SEEN_AT_ONCE)(self._look)

    def _options_of(self, *passes: TrackedFrame) -> Candidates:
        p = self._person
        others = [v for e in passes if e.others for v in e.others[p]]
        return Candidates(self._model, [e.poses[p] for e in passes], others)

    def carried(self) -> Iterator[int]:
        """Carry the poses through the stretch; the index of each frame that was come to."""
        locked = self._found[0].poses[self._person]
        ends = [e[i].poses[self._person] if e else None for e, i in ((self._before, -1), (self._after, 0))]
        ends = [None if e is None else with_locked_dofs(self._model, e, locked, self._free) for e in ends]
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
        match = ContourResiduals(views, bodies, person, settings.match, settings.theta_px, everywhere=True)
        apart = [BodyPenetration(bodies, person, settings.apart)] if len(bodies) > 1 and settings.apart > 0 else []
        return Sight(self._model, match, Colors(views, bodies, person), self._known, apart, settings, self._free)

    def _observed(self, i: int) -> tuple[ViewEvidence, ...]:
        """The evidence of a frame around what both passes found there, by which all poses are judged."""
        cameras = self._observer.working_cameras
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


def _colors(observer: Observer, models: Sequence[BodyModel], where: TrackedFrame, person: int) -> Colors:
    """The colours under a person on a frame on which they were not lost."""
    bodies = _bodies(models, where.poses)
    return Colors(observer.evidence(where.frame, regions(observer.working_cameras, bodies)), bodies, person)
