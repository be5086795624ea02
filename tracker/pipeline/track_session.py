"""Drive one run of a tracker over a session: passes, estimate, and saving as one entry of the history."""

from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.motion.history import HISTORY_FRAMES
from tracker.body.motion.pose_steps import NEAR, moving_bodies
from tracker.compute.progress import mapped
from tracker.estimation.runs.frame_hypotheses import Proposal
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.runs.run_estimate import RunFrames, estimate_run
from tracker.estimation.search.chamfer_cost import frame_cost
from tracker.estimation.tracking.confidence import Status, status_named
from tracker.estimation.tracking.tracker import (
    BackwardStep,
    NormalMatrix,
    PoseEstimate,
    Subjects,
    TrackedFrame,
    Tracker,
    TrackingRun,
)
from tracker.estimation.trajectory.solve import even_blocks
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.pipeline.calibration_check import contradiction
from tracker.pipeline.keyframe_stretches import between_keyframes, seam_of, with_seam
from tracker.pipeline.methods import compared_by
from tracker.pipeline.posed_recording import PosedRecording
from tracker.pipeline.tracked_changes import (
    PoseWriter,
    RunChange,
    StoredPerson,
    assessed_keyframe,
    estimated_row,
    pose_change,
    settings_record,
    tracked_changes,
)
from tracker.session.store.records import AssessmentChange, PoseChange, PoseRecord


class EstimateStep(NamedTuple):
    """Progress of the estimate of all poses."""

    done: int
    total: int


class EstimatedRows(NamedTuple):
    """The poses of a run, estimated from all its frames."""

    changes: tuple[PoseChange, ...]
    """The rows of all people, which take the place of those with tracked poses."""
    keyframes: tuple[AssessmentChange, ...] = ()
    """The assessment of their keyframes, which stay."""


class CameraStep(NamedTuple):
    """The poses of a finished run contradict the calibration."""

    contradiction: str
    """A sentence for the user."""


Step = PoseEstimate | BackwardStep | EstimateStep | EstimatedRows | CameraStep
"""A step of a run: a frame of the first pass or of the second, progress of the estimate, all estimated poses, or a
camera that is off."""


class Leg(NamedTuple):
    """One direction of a run. It is tracked in blocks, each from the poses before it alone.

    A run that was interrupted goes on at a block, as one that was not.
    """

    run: TrackingRun
    """All frames of the leg, in the order of tracking."""
    before: Sequence[TrackedFrame] = ()
    """Frames that are known: the first blocks of an interrupted run, or the start. In the order of tracking."""
    start: int | None = None
    """Frame whose stored pose the run goes out from. It is tracked to learn from it; a pose that was found is estimated
    with the others."""
    stored: Mapping[int, PoseRecord] = {}
    """Stored poses of the start by person."""
    history: Mapping[int, Sequence[Array]] = {}
    """Stored poses of all people on the frames just before the leg, which show the motion there."""

    @property
    def left(self) -> list[slice]:
        """Places of the blocks that are left to track."""
        frames, known = self.run.frames, {f.frame for f in self.before}
        return [own for own, _ in even_blocks(len(frames)) if frames[own][-1] not in known]

    @property
    def frames(self) -> list[int]:
        """The frames that are left to track and store."""
        return [k for own in self.left for k in self.run.frames[own] if k != self.start]


def outward(frames: Sequence[int], start: int) -> list[Sequence[int]]:
    """Return the frames of each leg of a run that goes out from a frame: back to the first, then on to the last.

    Args:
        frames: all frames, ascending.
        start: one of them. Each leg begins with it.
    """
    legs = [k for k in frames if k <= start][::-1], [k for k in frames if k >= start]
    return [leg for leg in legs if len(leg) > 1] or [[start]]


class TrackSession:
    """One run of a tracker and its results so far. It has one leg, or two that go out from a start.

    `first_pass`, `backward_pass`, `estimate` and `cameras` do the work in this order. Any thread may drain them. Each
    step is handed to `take` before the next one is asked for, under the lock of results and writer. A run stops where
    its steps are no longer asked for, and goes on where they are again.
    """

    def __init__(
        self,
        tracker: Tracker,
        legs: Sequence[Leg],
        stored: Sequence[StoredPerson],
        writer: PoseWriter,
        label: str,
        save_frames: int | None = None,
        records_before: Mapping[tuple[int, int], PoseRecord] | None = None,
    ) -> None:
        """Prepare a run; no frame is read yet.

        Args:
            tracker: the method and its settings.
            legs: what is tracked; at least one. All are of the same people and cameras.
            stored: all people of the session.
            writer: where poses are saved.
            label: of the entry of the history.
            save_frames: frames after which `take` saves; None leaves that to calls of `save`.
            records_before: poses that an interrupted run has stored, by person and frame.
        """
        self.tracker, self.legs, self.label = tracker, legs, label
        self.frames = [k for leg in legs for k in leg.frames]
        """The frames to track, in their order."""
        self._stored, self._writer, self._save_frames = stored, writer, save_frames
        self.tracked = {f.frame: f for leg in legs for f in leg.before}
        """Frames tracked so far by their number, with those that were known before."""
        self.costs_px: dict[int, float] = {}
        """Cost of each frame that this run has tracked, px."""
        self.normal_matrices: dict[int, tuple[NormalMatrix | None, ...]] = {}
        """How well contours determine the pose of each person, by frame; empty where the method does not compute it."""
        self.n_moved = 0
        """Number of poses with a limb elsewhere than where the first pass had it."""
        self.visited: int | None = None
        """The frame that the backward pass visited last; None before it."""
        self.finished = False
        """Whether both passes and the estimate are done."""
        self.contradiction = ""
        """A sentence if the contours contradict the calibration; empty before the end, or if they do not."""
        self._proposals: dict[tuple[int, int], list[Proposal]] = {}
        self._backward: dict[int, tuple[Array, ...]] = {}
        self._records = dict(records_before or {})
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

    def ends(self, frame: int) -> tuple[int, int]:
        """Return the first and the last frame of the leg that tracks a frame."""
        known = [(leg.run.frames[0], leg.run.frames[-1]) for leg in self.legs if leg.frames]
        return next((a, b) for a, b in known if min(a, b) <= frame <= max(a, b))

    def steps(self) -> Iterator[Step]:
        """Run both passes, estimate the poses, and look at the cameras."""
        yield from self.first_pass()
        yield from self.backward_pass()
        yield from self.estimate()
        yield from self.cameras()

    def first_pass(self) -> Iterator[PoseEstimate]:
        """Track the frames of each leg."""
        for leg in self.legs:
            for own in leg.left:
                run = self._run_of(leg, own)
                yield from (self._scored(found) for found in self.tracker.estimates(run) if found.frame != leg.start)

    def _scored(self, found: PoseEstimate) -> PoseEstimate:
        """Return an estimate with the cost of its poses; without one if the estimate of all frames is to move them."""
        if self.tracker.settings.whole_run:
            return found._replace(cost_px=np.nan, view_costs_px=np.empty(0))
        near = {k: self.tracked[k].poses for k in (found.frame + n for n in NEAR) if k in self.tracked}
        bodies = moving_bodies(self.subjects.models, near | {found.frame: found.poses}, found.frame)
        cost = frame_cost(self.observer.origin.evidence(found.frame), bodies)
        return found._replace(cost_px=cost.total_px, view_costs_px=cost.view_costs_px)

    def _run_of(self, leg: Leg, own: slice) -> TrackingRun:
        """Return the run of a block of a leg, which begins at the poses before it."""
        frames = leg.run.frames
        if own.start == 0:
            return replace(leg.run, frames=frames[own])
        before = [self.tracked[k].poses for k in frames[max(0, own.start - HISTORY_FRAMES) : own.start]]
        return replace(leg.run, start=[*zip(*before, strict=True)], frames=frames[own])

    def backward_pass(self) -> Iterator[BackwardStep]:
        """Track each leg once more from its last frame back to its first. Its poses are proposals."""
        if not self.tracker.settings.whole_run:
            return
        legs = [leg for leg in self.legs if len(leg.run.frames) > 1]
        done, total = 0, sum(len(leg.run.frames) for leg in legs)
        for leg in legs:
            frames = leg.run.frames[::-1]
            last = [[pose] for pose in self.tracked[frames[0]].poses]
            for found in self.tracker.estimates(replace(leg.run, start=last, frames=frames)):
                done += 1
                yield BackwardStep(TrackedFrame.of(found), done, total)

    def estimate(self) -> Iterator[EstimateStep | EstimatedRows]:
        """Estimate the poses of all people and assess them. Their rows come last: as a whole or not at all."""
        if self.tracker.settings.whole_run:
            yield (yield from self._estimated())
        self.finished = True

    def _estimated(self) -> Generator[EstimateStep, None, EstimatedRows]:
        settings, subjects = compared_by(self.tracker.settings), self.subjects
        proposals = {at: [*estimate] for at, estimate in self._proposals.items()}
        for k, tracked in self.tracked.items():
            for i in subjects.tracked if tracked.alternatives else ():
                proposals.setdefault((k, i), []).extend(Proposal(p, "alternative") for p in tracked.alternatives[i])
        poses = {k: tracked.poses for k, tracked in self.tracked.items()}
        before = {k: own for leg in self.legs for k, own in leg.history.items()}
        run = RunFrames(self.observer, subjects, settings, self.legs[0].run.fps, poses, proposals, before)
        estimate = yield from mapped(estimate_run(run), lambda step: EstimateStep(*step))
        return self._rows_estimated(estimate)

    def _rows_estimated(self, found: Mapping[int, Mapping[int, RunPose]]) -> EstimatedRows:
        """Return the rows of estimated poses, by person and frame."""
        subjects, changes, keyframes = self.subjects, list[PoseChange](), list[AssessmentChange]()
        settings = settings_record(self.tracker.settings)
        starts = {leg.start: leg.stored for leg in self.legs if leg.start is not None}
        for i, of_person in found.items():
            model, stored = subjects.models[i], self._stored[i]
            between = between_keyframes(subjects.keyframes, i, sorted(of_person))
            for k, pose in of_person.items():
                keyframe = subjects.keyframes_at(k).get(i)
                if keyframe is not None:
                    keyframes.append(assessed_keyframe(model, stored.name, k, keyframe, pose))
                    continue
                before = self._records.get((i, k)) or starts.get(k, {}).get(i)
                row = estimated_row(model, before, pose, stored.revision, settings)
                if k in between and k in self._backward:
                    ends = between[k]
                    held = [subjects.keyframes[end][i] for end in ends]
                    row = with_seam(
                        model, row, seam_of(model, self.tracked[k].poses[i], self._backward[k][i], ends, held)
                    )
                changes.append(pose_change(stored.name, k, row, pose, stored.revision))
        return EstimatedRows(tuple(changes), tuple(keyframes))

    def cameras(self) -> Iterator[CameraStep]:
        """Look whether the contours contradict the calibration; see `contradiction`."""
        if len(self.subjects.tracked) == len(self._stored):  # Contours of other people would contradict it.
            fps, models = self.legs[0].run.fps, self.subjects.models
            if found := contradiction(PosedRecording.of_run(self.observer, fps, models, self.tracked)):
                yield CameraStep(found)

    def take(self, step: Step) -> None:
        """Keep the results of a step."""
        match step:
            case PoseEstimate():
                self._take_tracked(step)
            case BackwardStep(found=found):
                self._take_backward(found)
            case EstimatedRows():
                self._take_estimated(step)
            case CameraStep(contradiction=sentence):
                self.contradiction = sentence

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

    def status_counts(self) -> list[Counter[Status]]:
        """Return how often each person had which status on the frames of this run; on all if none was left to track."""
        of_frames = [self.tracked[k].statuses for k in self.costs_px or self.tracked]
        return [Counter(s[i] for s in of_frames) for i in range(len(self._stored))]

    def _take_tracked(self, found: PoseEstimate) -> None:
        self._waiting += self._rows_of(found)
        self._n_waiting += 1
        self.tracked[found.frame] = TrackedFrame.of(found)
        self.costs_px[found.frame] = found.cost_px
        if found.normal_matrices:
            self.normal_matrices[found.frame] = found.normal_matrices
        if self._save_frames is not None and self._n_waiting >= self._save_frames:
            self.save()

    def _take_backward(self, found: TrackedFrame) -> None:
        self.save()
        self.visited = found.frame
        self._backward[found.frame] = found.poses
        for i in self.subjects.tracked:
            known = self._proposals.setdefault((found.frame, i), [])
            known.append(Proposal(found.poses[i], "backward"))
            known += [Proposal(pose, "alternative") for pose in (found.alternatives[i] if found.alternatives else ())]

    def _take_estimated(self, step: EstimatedRows) -> None:
        self.save()
        for i, person in enumerate(self._stored):
            poses = {c.frame: c.pose for c in step.changes if c.person == person.name and c.pose is not None}
            statuses = {k: pose.status for k, pose in poses.items()}
            statuses |= {c.frame: c.status for c in step.keyframes if c.person == person.name}
            self.n_moved += sum(any(x.kind == "path" for x in pose.trace or ()) for pose in poses.values())
            for frame in statuses.keys() & self.tracked.keys():
                values = poses[frame].values if frame in poses else None
                cost_px = poses[frame].cost_px if frame in poses else None
                if frame in self.costs_px and cost_px is not None:
                    self.costs_px[frame] = cost_px
                self.tracked[frame] = self.tracked[frame].assessed(i, status_named(statuses[frame]), values)
        self._write([*step.changes, *step.keyframes])
        self.finished = True

    def _rows_of(self, found: PoseEstimate) -> list[PoseChange]:
        """Return the rows of an estimate, and keep them."""
        changes = list[PoseChange]()
        for i in self.subjects.tracked:
            rows = tracked_changes([found], self._stored, [i], self.subjects.keyframes, self.tracker.settings)
            self._records |= {(i, c.frame): c.pose for c in rows if c.pose is not None}
            changes += rows
        return changes

    def _write(self, changes: Sequence[RunChange]) -> None:
        if changes:
            self._edit = self._writer.write(self.label, changes, self._edit)
