"""Drive one run of a tracker over a session: both passes, smoothing, and saving as one entry of the history."""

from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from tracker.body.model import PosedBody
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.pipeline.calibration_check import contradiction
from tracker.pipeline.posed_recording import PosedRecording
from tracker.pipeline.run_repair import RepairStep, RunRepair
from tracker.pipeline.smoothing import TrackedRows
from tracker.pipeline.tracked_changes import PoseWriter, RunChange, StoredPerson, tracked_changes
from tracker.store.records import AssessmentChange, PoseChange
from tracker.tracking.confidence import Status, status_named
from tracker.tracking.estimate import BackwardStep, NormalMatrix, PoseEstimate, TrackedFrame
from tracker.tracking.estimation.frame_problem import Bodies
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.person_memory import HISTORY_FRAMES
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import Tracker, TrackingRun
from tracker.tracking.view_tracks import FrameTracks, tracks_without_views, velocities_of


class SmoothedRows(NamedTuple):
    """The result of smoothing a run and of classifying its poses again."""

    changes: tuple[PoseChange, ...]
    """The rows of all people, which take the place of those with tracked poses."""
    keyframes: tuple[AssessmentChange, ...] = ()
    """The assessment of their keyframes, which stay."""


class AuditStep(NamedTuple):
    """A frame that was tracked without each view in turn."""

    frame: int
    tracks: Mapping[int, FrameTracks]
    """By index of the person."""
    done: int
    """Frames so far."""
    total: int


class SolveStep(NamedTuple):
    """Progress of the solve of the paths."""

    done: int
    """Frames so far."""
    total: int


class CameraStep(NamedTuple):
    """The poses of a finished run contradict the calibration."""

    contradiction: str
    """A sentence for the user."""


Step = PoseEstimate | BackwardStep | AuditStep | RepairStep | SolveStep | SmoothedRows | CameraStep
"""A step of a run: a tracked frame of the first pass, a visit to a frame of the second, a frame of the audit, of
the repair or of the solve, all smoothed poses, or a camera that is off."""


class Leg(NamedTuple):
    """One direction of a run."""

    run: TrackingRun
    """Gives the frames that are left to track, in their order; none where all are tracked."""
    before: Sequence[TrackedFrame] = ()
    """Frames of the same leg that are known: those of an interrupted run, or the start. In the order of tracking."""
    start: int | None = None
    """Frame whose stored pose the run goes out from. It is tracked to learn from it, and keeps its stored pose."""

    @property
    def frames(self) -> list[int]:
        """The frames that this leg stores poses of."""
        return [k for k in self.run.frames if k != self.start]

    @property
    def whole(self) -> list[int]:
        """All frames from the first known one on, in the order of tracking."""
        known = [f.frame for f in self.before]
        return [*known, *(k for k in self.run.frames if k not in known)]


def outward(frames: Sequence[int], start: int) -> list[Sequence[int]]:
    """Return the frames of each leg of a run that goes out from a frame: back to the first, then on to the last.

    Args:
        frames: all frames, ascending.
        start: one of them. Each leg begins with it.
    """
    legs = [k for k in frames if k <= start][::-1], [k for k in frames if k >= start]
    return [leg for leg in legs if len(leg) > 1] or [[start]]


def _with_starts(legs: Sequence[Leg]) -> Subjects:
    """Return the subjects with the poses that a run goes out from among the keyframes: both are stored already."""
    subjects = legs[0].run.subjects
    keyframes = dict(subjects.keyframes)
    for leg in legs:
        for frame, poses, *_ in leg.before:
            if frame == leg.start:
                keyframes[frame] = {**dict(enumerate(poses)), **keyframes.get(frame, {})}
    return replace(subjects, keyframes=keyframes)


def _solve_steps(
    steps: Generator[int, None, list[PoseChange]], before: int, total: int
) -> Generator[SolveStep, None, list[PoseChange]]:
    """Report how many frames of all people steps have read; return their result."""
    while True:
        try:
            yield SolveStep(before + next(steps), total)
        except StopIteration as end:
            found: list[PoseChange] = end.value
            return found


class TrackSession:
    """One run of a tracker and its results so far. It has one leg, or two that go out from a start.

    `first_pass`, `backward_pass`, `audit`, `repair`, `smoothing` and `cameras` do the work in this order. Any
    thread may drain them. Each step is handed to `take` before the next one is asked for, under the lock of results and
    writer. A run stops where its steps are no longer asked for, and goes on where they are again.
    """

    def __init__(
        self,
        tracker: Tracker,
        legs: Sequence[Leg],
        stored: Sequence[StoredPerson],
        writer: PoseWriter,
        label: str,
        save_frames: int | None = None,
        rows_before: Mapping[int, TrackedRows] | None = None,
    ) -> None:
        """Prepare a run; no frame is read yet.

        Args:
            tracker: the method and its settings.
            legs: what is tracked; at least one. All are of the same people and cameras.
            stored: all people of the session.
            writer: where poses are saved.
            label: of the entry of the history.
            save_frames: frames after which `take` saves; None leaves that to calls of `save`.
            rows_before: rows of an interrupted run by person; this run adds its own.
        """
        self.tracker, self.legs, self.label = tracker, legs, label
        self._stored, self._writer, self._save_frames = stored, writer, save_frames
        self.tracked = {f.frame: f for leg in legs for f in leg.before}
        """Frames tracked so far by their number, with those that were known before."""
        self.costs_px: dict[int, float] = {}
        """Cost of each frame that this run has tracked, px."""
        self.normal_matrices: dict[int, tuple[NormalMatrix | None, ...]] = {}
        """How well contours determine the pose of each person, by frame; empty where the method does not compute it."""
        self.n_improved = 0
        """Number of poses that the backward pass has replaced."""
        self.visited: int | None = None
        """The frame that the backward pass visited last; None before it."""
        self.finished = False
        """Whether both passes and smoothing are done."""
        self.contradiction = ""
        """A sentence if the contours contradict the calibration; empty before the end, or if they do not."""
        self._held = _with_starts(legs)
        self._rows = {i: (rows_before or {}).get(i, TrackedRows()) for i in self.subjects.tracked}
        self._waiting: list[PoseChange] = []
        self._n_waiting = 0
        self._edit: int | None = None

    @property
    def subjects(self) -> Subjects:
        """The people, and their keyframes."""
        return self.legs[0].run.subjects

    @property
    def observer(self) -> Observer:
        """Gives the evidence of the cameras that are tracked with."""
        return self.legs[0].run.observer

    @property
    def frames(self) -> list[int]:
        """The frames to track, in their order."""
        return [k for leg in self.legs for k in leg.frames]

    def ends(self, frame: int) -> tuple[int, int]:
        """Return the first and the last frame of the leg that tracks a frame."""
        known = [(leg.run.frames[0], leg.run.frames[-1]) for leg in self.legs if leg.frames]
        return next((a, b) for a, b in known if min(a, b) <= frame <= max(a, b))

    def steps(self) -> Iterator[Step]:
        """Run both passes, audit, repair and smooth the poses, and look at the cameras."""
        yield from self.first_pass()
        yield from self.backward_pass()
        yield from self.audit()
        yield from self.repair()
        yield from self.smoothing()
        yield from self.cameras()

    def first_pass(self) -> Iterator[PoseEstimate]:
        """Track the frames of each leg."""
        for leg in self.legs:
            if leg.frames:
                yield from (found for found in self.tracker.estimates(leg.run) if found.frame != leg.start)

    def backward_pass(self) -> Iterator[BackwardStep]:
        """Track backward between keyframes, and where people were lost, in this run or before it was interrupted."""
        for leg in self.legs:
            known = [f.frame for f in leg.before]
            tracked = [self.tracked[k] for k in (*known, *leg.frames)]
            yield from self.tracker.backward_pass(leg.run, tracked)

    def audit(self) -> Iterator[AuditStep]:
        """Track all frames once more without each view in turn, each leg from its first pose; see `view_tracks`.

        A leg that is shorter than what a tracker remembers is left out: its tracks would have no history of their own.
        """
        legs = [leg for leg in self.legs if self.tracker.settings.audit and len(leg.whole) > HISTORY_FRAMES]
        done, total = 0, sum(len(leg.whole) for leg in legs)
        for leg in legs:
            first = self.tracked[leg.whole[0]].poses
            # A pose and the same one before it are a prediction: the tracker does not search around it again.
            run = replace(leg.run, start=[[pose, pose] for pose in first], frames=leg.whole)
            known = {k: self.tracked[k].poses for k in leg.whole}
            for frame, tracks in tracks_without_views(self.tracker, run, known):
                done += 1
                yield AuditStep(frame, tracks, done, total)

    def repair(self) -> Iterator[RepairStep]:
        """Compare the consensus of the tracks with the colours of the whole run, and search limbs; see `run_repair`."""
        settings, subjects = self.tracker.settings, self._held
        frames = [k for leg in self.legs for k in leg.whole if all(k in r.tracks for r in self._rows.values())]
        if not frames or not isinstance(settings, EstimationSettings):
            return
        bodies = self._bodies(frames)
        tracks = {i: rows.tracks for i, rows in self._rows.items()}

        others = {(k, i): poses for k in frames for i, poses in enumerate(self.tracked[k].alternatives)}
        yield from RunRepair(self.observer, subjects, settings, bodies, tracks, others).steps()

    def _bodies(self, frames: Sequence[int]) -> dict[int, Bodies]:
        """Return all people on some frames, by all that is known so far."""
        subjects, known = self._held, dict[int, list[Array]]()
        for k in frames:
            known[k] = [*self.tracked[k].poses]
            for i, rows in self._rows.items():
                if i not in subjects.keyframes_at(k) and k in rows:
                    known[k][i] = rows.best_pose(subjects.models[i], k, subjects.active_dofs[i])
        velocities = velocities_of(subjects.models, known)
        out = dict[int, Bodies]()
        for k in frames:
            moving = velocities(k) if any(self.observer.ahead_frames(k)) else [None] * len(subjects.models)
            out[k] = tuple(map(PosedBody, subjects.models, known[k], moving))
        return out

    def smoothing(self) -> Iterator[SolveStep | SmoothedRows]:
        """Solve the paths of all people and assess them. Their rows come last: as a whole or not at all."""
        smooth = self.tracker.settings.smooth
        if smooth or any(rows.is_compared for rows in self._rows.values()):
            held, fps, changes = self._held, self.legs[0].run.fps, list[PoseChange]()
            evidence = self.tracker.evidence(self.observer, lambda: self._bodies(sorted(self.tracked)))
            n = len(self.tracked)
            for i, (person, rows) in enumerate(self._rows.items()):
                steps = rows.finished(held, person, fps, smooth, evidence)
                changes += yield from _solve_steps(steps, i * n, len(self._rows) * n)
            assessed = (self._assessed_keyframes(person) for person in self._rows)
            yield SmoothedRows(tuple(changes), tuple(change for found in assessed for change in found))
        self.finished = True

    def cameras(self) -> Iterator[CameraStep]:
        """Look whether the contours contradict the calibration; see `contradiction`."""
        if len(self.subjects.tracked) == len(self._stored):  # Contours of other people would contradict it.
            fps, models = self.legs[0].run.fps, self.subjects.models
            if found := contradiction(PosedRecording.of_run(self.observer, fps, models, self.tracked)):
                yield CameraStep(found)

    def _assessed_keyframes(self, person: int) -> list[AssessmentChange]:
        keyframes = {k: own[person] for k, own in self.subjects.keyframes.items() if person in own}
        name = self._stored[person].name
        return self._rows[person].assessed_keyframes(self.subjects.models[person], name, keyframes)

    def take(self, step: Step) -> None:
        """Keep the results of a step.

        An interval that the backward pass improves is saved at once, as a whole or not at all.
        """
        if isinstance(step, BackwardStep):
            self._take_improved(step)
            return
        if isinstance(step, SmoothedRows):
            self._take_finished(step)
            return
        if isinstance(step, CameraStep):
            self.contradiction = step.contradiction
            return
        if isinstance(step, SolveStep):
            return
        if isinstance(step, AuditStep):
            for person, tracks in step.tracks.items():
                self._rows[person].add_tracks(step.frame, tracks)
            return
        if isinstance(step, RepairStep):
            for person, poses in (step.found or {}).items():
                self._rows[person].add_repaired(poses)
            return
        self._waiting += self._rows_of([step], self.subjects.tracked)
        self._n_waiting += 1
        self.tracked[step.frame] = TrackedFrame.of(step)
        self.costs_px[step.frame] = step.cost_px
        if step.normal_matrices:
            self.normal_matrices[step.frame] = step.normal_matrices
        if self._save_frames is not None and self._n_waiting >= self._save_frames:
            self.save()

    def save(self) -> None:
        """Save the frames that are not saved yet."""
        self._write(self._waiting)
        self._waiting.clear()
        self._n_waiting = 0

    @property
    def has_unsaved(self) -> bool:
        """Whether there are tracked frames that are not saved yet."""
        return self._n_waiting > 0

    @property
    def next_frame(self) -> int | None:
        """The first frame that is not tracked yet; None where all are."""
        done, frames = len(self.costs_px), self.frames
        return frames[done] if done < len(frames) else None

    def rows_record(self) -> dict[str, Any]:
        """Return the covariances and features with which a resumed run smooths the frames of this one."""
        return {str(person): rows.record() for person, rows in self._rows.items()}

    def status_counts(self) -> list[Counter[Status]]:
        """Return how often each person had which status on the frames of this run; on all if none was left to track."""
        of_frames = [self.tracked[k].statuses for k in self.costs_px or self.tracked]
        return [Counter(s[i] for s in of_frames) for i in range(len(self._stored))]

    def _take_improved(self, step: BackwardStep) -> None:
        self.save()
        self.visited = step.frame
        for found in step.better:
            self.tracked[found.frame] = TrackedFrame.of(found)
            if found.frame in self.costs_px:
                self.costs_px[found.frame] = found.cost_px
        self.n_improved += len(step.better)
        if step.other_pass is not None:
            self._rows[step.person].add_other_pass(step.other_pass)
        self._write(self._rows_of(step.better, [step.person]))

    def _take_finished(self, step: SmoothedRows) -> None:
        self.save()
        for i, person in enumerate(self._stored):
            poses = {c.frame: c.pose for c in step.changes if c.person == person.name and c.pose is not None}
            statuses = {k: pose.status for k, pose in poses.items()}
            statuses |= {c.frame: c.status for c in step.keyframes if c.person == person.name}
            for frame in statuses.keys() & self.tracked.keys():
                values = poses[frame].values if frame in poses else None
                self.tracked[frame] = self.tracked[frame].assessed(i, status_named(statuses[frame]), values)
        self._write([*step.changes, *step.keyframes])
        self.finished = True

    def _rows_of(self, found: Sequence[PoseEstimate], people: Sequence[int]) -> list[PoseChange]:
        """Return the rows of estimates, and keep them for smoothing."""
        keyframes, settings = self._held.keyframes, self.tracker.settings
        changes: list[PoseChange] = []
        for estimate in found:
            for person in people:
                rows = tracked_changes([estimate], self._stored, [person], keyframes, settings)
                for change in rows:
                    self._rows[person].add(change, estimate.covariances[person], estimate.qualities[person])
                changes += rows
        return changes

    def _write(self, changes: Sequence[RunChange]) -> None:
        if changes:
            self._edit = self._writer.write(self.label, changes, self._edit)
