"""Track people backward: between two keyframes, and through intervals in which they were lost.

A limb that is lost in fast motion is found again where the motion slows down. Tracked backward from there, it is often
found on frames where it was lost. If it is lost in both directions, the two passes are seldom wrong on the same
frames. Therefore the candidates of both are propagated to neighbouring frames, and one path through all frames of the
interval is selected (`pose_paths`).

Between two keyframes of a person, all frames are tracked backward from the second one. The path through both passes
changes from one to the other where they agree best. Their disagreement on a frame is its *seam*.

Stored poses by the same settings stay candidates of the path, also beyond the last keyframe. A run then replaces a pose
only where frames and motion speak for the new pose.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from itertools import pairwise, takewhile
from typing import NamedTuple

import numpy as np

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.model import PosedBody
from tracker.body.searches import Search
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.fitting.hypothesis import SAME_POSE_M, distance_m
from tracker.geometry.arrays import Array
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import BackwardStep, OtherPass, PoseEstimate, TrackedFrame
from tracker.tracking.estimation.assessment import estimate_at, estimate_fixed
from tracker.tracking.estimation.forward_pass import make_estimate, track_forward
from tracker.tracking.estimation.frame_estimator import FrameEstimator
from tracker.tracking.estimation.frame_problem import Bodies, FrameProblem, PersonPrior
from tracker.tracking.estimation.pose_paths import ROUNDS, Candidates, propagate_candidates, viterbi_path
from tracker.tracking.estimation.pose_score import PoseScorer, common_evidence, scorer_without_prediction
from tracker.tracking.estimation.settings import EstimationSettings, chamfer_cost, trust
from tracker.tracking.subjects import Keyframes, Subjects
from tracker.tracking.tracker import TrackingRun
from tracker.tracking.view_regions import regions
from tracker.tracking.view_tracks import velocities_of

_TRUSTED_FRAMES = 3
"""Number of good frames in a row that end an interval, and from which its motion is predicted. A lost limb may look
good by chance on fewer."""
_CACHED_FRAMES = 32
"""Number of frames whose evidence is cached while candidates are propagated, some megabytes each."""


class _Interval(NamedTuple):
    """Frames on which one person is tracked backward."""

    person: int
    frames: range
    """Indices into the tracked frames. Backward tracking begins on the one after the last."""
    lost: tuple[range, ...]
    """Those in which the person was lost: candidates are propagated through them."""
    is_between_keyframes: bool = False
    """Whether a keyframe lies before the first frame and after the last."""

    @property
    def n_visits(self) -> int:
        """How often its frames are visited."""
        return len(self.frames) + 2 * ROUNDS * sum(map(len, self.lost))


def lost_intervals(statuses: Sequence[Status], keyframes: Sequence[bool]) -> list[range]:
    """Return the intervals in which one person was lost, as indices. The first and last frame of each are not good.

    Intervals separated by a few good frames are joined, unless a keyframe lies between them.

    Args:
        statuses: of the person on each frame, in the order of tracking.
        keyframes: whether the person's pose is a keyframe, likewise.
    """
    out: list[range] = []
    for i in (i for i, status in enumerate(statuses) if status != "good" and not keyframes[i]):
        if out and i - out[-1].stop < _TRUSTED_FRAMES and not any(keyframes[out[-1].stop : i]):
            out[-1] = range(out[-1].start, i + 1)
        else:
            out.append(range(i, i + 1))
    return [r for r in out if any(statuses[i] == "lost" for i in r)]


def track_backward(
    run: TrackingRun, tracked: Sequence[TrackedFrame], settings: EstimationSettings,
    make_estimator: type[FrameEstimator] = FrameEstimator,
) -> Iterator[BackwardStep]:  # fmt: skip
    """Track people backward between two keyframes each, and through other intervals in which they were lost.

    The other people keep their poses. Without such an interval no frame is read.

    Args:
        run: gives the observer and the subjects.
        tracked: all frames, in the order of tracking.
        settings: of the tracker.
        make_estimator: estimates a frame by the tracker's method.

    Yields:
        A step for each visit to a frame; the last of an interval with the estimates that are better.
    """
    known, subjects = list(tracked), run.subjects
    work = [s for person in subjects.tracked for s in _intervals_of(known, person, subjects.keyframes)]
    work.sort(key=lambda s: s.frames.stop)
    total, done = sum(s.n_visits for s in work), 0
    for interval in work:
        person, backward, last = interval.person, list[PoseEstimate](), done + interval.n_visits
        for estimate in _track_interval(run, known, interval, settings, make_estimator):
            backward.append(estimate)
            done += 1
            if done < last:
                yield BackwardStep(estimate.frame, person, done, total)
        backward.reverse()
        selection = _PathSelection(run, known, interval, backward, settings)
        for i in selection.propagate():
            done += 1
            if done < last:
                yield BackwardStep(backward[i].frame, person, done, total)
        better = selection.better()
        other = selection.other_pass() if interval.is_between_keyframes else None
        at = {f.frame: i for i, f in enumerate(known)}
        for estimate in better:
            known[at[estimate.frame]] = TrackedFrame.of(estimate)
        yield BackwardStep(backward[0].frame, person, done, total, better, other)
    for person in subjects.tracked:
        for interval in _changed_intervals(known, person, subjects):
            better = _PathSelection(run, known, interval, (), settings).better()
            at = {known[i].frame: i for i in interval.frames}
            for estimate in better:
                known[at[estimate.frame]] = TrackedFrame.of(estimate)
            yield BackwardStep(known[interval.frames.start].frame, person, total, total, better)


def _intervals_of(tracked: Sequence[TrackedFrame], person: int, keyframes: Keyframes) -> list[_Interval]:
    """Return the intervals of one person between two keyframes, and the lost ones elsewhere.

    The latter end on a frame from which backward tracking can begin.
    """
    statuses = [f.statuses[person] for f in tracked]
    is_keyframe = [person in keyframes.get(f.frame, {}) for f in tracked]
    out, lost = [], lost_intervals(statuses, is_keyframe)
    for first, last in pairwise(i for i, fixed in enumerate(is_keyframe) if fixed):
        frames = range(first + 1, last)
        if frames:
            within = tuple(r for r in lost if r.start in frames)
            lost = [r for r in lost if r.start not in frames]
            out.append(_Interval(person, frames, within, True))
    for frames in lost:
        end = frames.stop
        if end == len(tracked):  # no trusted frame follows: begin on the last frame that is not lost
            end = max((i for i in frames if statuses[i] != "lost"), default=frames.start)
        if end > frames.start:
            whole = range(frames.start, end)
            out.append(_Interval(person, whole, (whole,)))
    return out


def _changed_intervals(tracked: Sequence[TrackedFrame], person: int, subjects: Subjects) -> list[_Interval]:
    """Return the intervals that are not between two keyframes, and on which the former poses of a person are others."""
    model, keyframes = subjects.models[person], [person in subjects.keyframes_at(f.frame) for f in tracked]
    ends = [i for i, fixed in enumerate(keyframes) if fixed]
    changed = []
    for i, found in enumerate(tracked):
        former = None if ends and ends[0] <= i <= ends[-1] else subjects.former.get(found.frame, {}).get(person)
        poses = [] if former is None else [PosedBody(model, pose) for pose in (former, found.poses[person])]
        if poses and distance_m(*poses) > SAME_POSE_M:
            changed.append(i)
    out: list[_Interval] = []
    for i in changed:
        if out and out[-1].frames.stop == i:
            out[-1] = out[-1]._replace(frames=range(out[-1].frames.start, i + 1))
        else:
            out.append(_Interval(person, range(i, i + 1), ()))
    return out


def _track_interval(
    run: TrackingRun, tracked: Sequence[TrackedFrame], interval: _Interval, settings: EstimationSettings,
    make_estimator: type[FrameEstimator],
) -> Iterator[PoseEstimate]:  # fmt: skip
    """Track one person from the last frame of an interval to its first; the others keep their poses."""
    subjects, person, (first, end) = run.subjects, interval.person, (interval.frames.start, interval.frames.stop)
    after = takewhile(lambda f: f.statuses[person] == "good", tracked[end + 1 : end + 1 + _TRUSTED_FRAMES])
    ahead = [*reversed(list(after)), tracked[end]]
    start = [[f.poses[p] for f in ahead] for p in range(len(subjects.models))]
    fixed = {f.frame: {p: v for p, v in enumerate(f.poses) if p != person} for f in tracked[first : end + 1]}
    # Locked degrees of freedom have the values of the interval.
    fixed[tracked[end].frame][person] = with_locked_dofs(
        subjects.models[person], tracked[end].poses[person], tracked[first].poses[person], subjects.active_dofs[person]
    )
    frames = [f.frame for f in reversed(tracked[first : end + 1])]
    alone = replace(subjects, tracked=(person,), keyframes=fixed)
    return track_forward(TrackingRun(run.observer, alone, start, frames), settings, make_estimator, lead_in=1)


class _PathSelection:
    """The candidate poses of one person in an interval, and the selection of a path through them."""

    def __init__(
        self, run: TrackingRun, tracked: Sequence[TrackedFrame], interval: _Interval,
        backward: Sequence[PoseEstimate], settings: EstimationSettings,
    ) -> None:  # fmt: skip
        """Collect the candidates of both passes.

        Args:
            run: gives the observer and the subjects.
            tracked: all frames.
            interval: the lost interval.
            backward: the estimates of backward tracking on its frames, in the order of tracking; empty without any.
            settings: of the tracker.
        """
        self._observer, self._models, self._settings = run.observer, run.subjects.models, settings
        self._person, (first, end) = interval.person, (interval.frames.start, interval.frames.stop)
        self._lost = [range(r.start - first, r.stop - first) for r in interval.lost]
        self._model, self._active_dofs = self._models[self._person], run.subjects.active_dofs[self._person]
        self._before, self._after = tracked[max(0, first - 2) : first], tracked[end : end + 2]
        self._velocities: Callable[[int], list[Array | None]] = lambda frame: [None] * len(self._models)
        if any(any(run.observer.ahead_frames(f.frame)) for f in tracked[first : end + 1]):
            self._velocities = velocities_of(self._models, {f.frame: f.poses for f in tracked})
        self._forward, self._backward = tracked[first:end], backward
        is_known = interval.is_between_keyframes or not backward
        former = [run.subjects.former.get(f.frame, {}).get(self._person) if is_known else None for f in self._forward]
        self._former = [self._locked(pose, i) for i, pose in enumerate(former)]
        self._candidates = [self._candidates_of(i) for i in range(len(self._forward))]
        self._views = lru_cache(_CACHED_FRAMES)(self._observe)
        self._scorer = lru_cache(_CACHED_FRAMES)(self._make_scorer)

    def propagate(self) -> Iterator[int]:
        """Propagate the candidates through the lost frames. Yields the index of each frame that is visited."""
        locked = self._forward[0].poses[self._person]
        around = [*self._before[-1:], *self._forward, *self._after[:1]]
        n_before, sigma = len(self._before[-1:]), trust(self._model, self._settings)
        for lost in self._lost:
            known = [around[i] if i >= 0 else None for i in (lost.start + n_before - 1, lost.stop + n_before)]
            ends = [None if f is None else f.poses[self._person] for f in known]
            ends = [None if e is None else with_locked_dofs(self._model, e, locked, self._active_dofs) for e in ends]
            scorers = partial(self._scorer_from, lost.start)
            visits = propagate_candidates(self._model, self._candidates[lost.start : lost.stop], scorers, ends, sigma)
            yield from (lost.start + i for i in visits)

    def better(self) -> tuple[PoseEstimate, ...]:
        """Return the estimates of the selected path that replace those of forward tracking, in tracking order."""
        out = []
        n_passes = 2 if self._backward else 1
        for i, chosen in enumerate(self._path):
            if 0 < chosen < n_passes:
                out.append(self._merged(i, 1, self._backward[i], f"tracked back from frame {self._after[0].frame}"))
            elif chosen > 0:
                is_former = chosen < n_passes + len(self._former[i])
                note = "as before this run" if is_former else "taken over from neighbouring frames"
                out.append(self._merged(i, chosen, self._estimate(i, chosen), note))
        return tuple(out)

    def other_pass(self) -> OtherPass:
        """Return the poses of the pass that was not selected."""
        found = [(self._forward if chosen == 1 else self._backward)[i] for i, chosen in enumerate(self._path)]
        ends = self._before[-1].frame, self._after[0].frame
        return OtherPass((min(ends), max(ends)), {f.frame: f.poses[self._person] for f in found})

    @cached_property
    def _path(self) -> list[int]:
        """The index of the selected candidate of each frame."""
        before, after = (
            [self._model.points_world(e.poses[self._person]) for e in some] for some in (self._before, self._after)
        )
        costs = [self._costs(i) for i in range(len(self._candidates))]  # may add alternatives to the candidates
        return viterbi_path([c.points for c in self._candidates], costs, before, after)

    def _costs(self, i: int) -> Array:
        """Return the costs of the candidates of a frame, nats; 0 for all where the passes agree, and none is known."""
        candidates = self._candidates[i]
        if not np.isfinite(candidates.costs).all():
            first, *others = (h.body for h in candidates.hypotheses)
            if all(distance_m(first, other) <= SAME_POSE_M for other in others):
                return np.zeros(len(candidates.poses))
            candidates.score(self._scorer(i))
        return candidates.costs

    def _scorer_from(self, first: int, i: int) -> PoseScorer:
        return self._scorer(first + i)

    @cached_property
    def _part_colors(self) -> PartColors | None:
        """Colours of the person on the trusted frames around the interval."""
        out: PartColors | None = None
        for good in (*self._before[-1:], *self._after[:1]):
            out = self._colors(good).learn(out, 0.5)
        return out

    def _locked(self, pose: Array | None, i: int) -> list[Array]:
        """Return a pose, if there is one, with the locked degrees of freedom of a frame of the interval."""
        locked = self._forward[i].poses[self._person]
        return [] if pose is None else [with_locked_dofs(self._model, pose, locked, self._active_dofs)]

    def _candidates_of(self, i: int) -> Candidates:
        p, passes = self._person, [self._forward[i], *map(TrackedFrame.of, self._backward[i : i + 1])]
        alternatives = [v for e in passes if e.alternatives for v in e.alternatives[p]]
        return Candidates(self._model, [*(e.poses[p] for e in passes), *self._former[i]], alternatives)

    def _bodies(self, i: int, pose: Array) -> Bodies:
        """Return all people on a frame of the interval, the person in a pose, (n_values,)."""
        poses = [pose if p == self._person else v for p, v in enumerate(self._forward[i].poses)]
        return tuple(map(PosedBody, self._models, poses, self._velocities(self._forward[i].frame)))

    def _make_scorer(self, i: int) -> PoseScorer:
        bodies = self._bodies(i, self._forward[i].poses[self._person])
        return scorer_without_prediction(
            self._views(i), bodies, self._person, self._settings, self._part_colors, self._active_dofs
        )

    def _observe(self, i: int) -> tuple[ViewEvidence, ...]:
        """Return the evidence of a frame around the passes and the former pose; all candidates are compared on it."""
        passes = [e.poses[self._person] for e in (self._forward[i], *self._backward[i : i + 1])]
        guesses = [self._bodies(i, pose) for pose in (*passes, *self._former[i])]
        return common_evidence(self._observer, self._forward[i].frame, guesses, self._settings)

    def _estimate(self, i: int, chosen: int) -> PoseEstimate:
        """Return the estimate of a frame with a candidate that was propagated there."""
        candidates, views, settings = self._candidates[i], self._views(i), self._settings
        bodies = self._bodies(i, candidates.poses[chosen])
        people = [
            PersonPrior(b.model, b.values, None, self._part_colors if p == self._person else None, b.velocity)
            for p, b in enumerate(bodies)
        ]
        problem = FrameProblem(views, people, settings)
        estimates = [
            estimate_at(problem, p, bodies, candidates.alternatives(chosen))
            if p == self._person
            else estimate_fixed(problem, p, bodies)
            for p in range(len(bodies))
        ]
        return make_estimate(self._forward[i].frame, chamfer_cost(views, bodies, settings), bodies, estimates, settings)

    def _merged(self, i: int, chosen: int, estimate: PoseEstimate, note: str) -> PoseEstimate:
        """Return an estimate with a note on the person, the entry of the choice, and the others' former statuses."""
        person, statuses, notes = self._person, list(self._forward[i].statuses), list(estimate.notes)
        statuses[person] = estimate.statuses[person]
        notes[person] = ", ".join(filter(None, (notes[person], note)))
        costs, traces = self._costs(i), list(estimate.traces or (None,) * len(notes))
        entry = Search.of("path", (), costs[0], costs[chosen], True)  # the forward pass is candidate 0
        traces[person] = (*(traces[person] or ()), entry)
        return estimate._replace(statuses=tuple(statuses), notes=tuple(notes), traces=tuple(traces))

    def _colors(self, frame: TrackedFrame) -> Colors:
        """Return the colours under the person on a frame on which they were not lost."""
        bodies = list(map(PosedBody, self._models, frame.poses, self._velocities(frame.frame)))
        views = self._observer.evidence(frame.frame, regions(self._observer.working_cameras, bodies))
        return Colors(views, bodies, self._person)
