"""Drive one run of a tracker over a session: both passes, smoothing, and saving as one entry of the history."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

from tracker.pipeline.smoothing import TrackedRows
from tracker.pipeline.tracked_changes import StoredPerson, tracked_changes
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange
from tracker.tracking.confidence import Status, status_named
from tracker.tracking.estimate import BackwardStep, NormalMatrix, PoseEstimate, TrackedFrame
from tracker.tracking.tracker import Tracker, TrackingRun


class SmoothedRows(NamedTuple):
    """The result of smoothing a run and of classifying its poses again."""

    changes: tuple[PoseChange, ...]
    """The rows of all people, which take the place of those with tracked poses."""


Step = PoseEstimate | BackwardStep | SmoothedRows
"""A step of a run: a tracked frame of the first pass, a visit to a frame of the second, or all smoothed poses."""


class Sink(Protocol):
    """Receives the poses of a run."""

    def write(self, label: str, changes: Sequence[PoseChange], edit: int | None) -> int | None:
        """Write poses, but leave keyframes as they are.

        Args:
            label: of the entry of the history.
            changes: at least one.
            edit: the result of the last call; None at the first.

        Returns:
            The entry of the history that further poses of the run are added to.
        """


class StoreSink:
    """Writes the poses of a run to a store at once."""

    def __init__(self, store: AnnotationStore, views: Sequence[int | None] = ()) -> None:
        """Write to a store that is open.

        Args:
            store: annotations of the session.
            views: for each camera of the session its index among those that are tracked with; empty for all.
        """
        self._store, self._views = store, views
        self._n_used = sum(v is not None for v in views)

    def write(self, label: str, changes: Sequence[PoseChange], edit: int | None) -> int:
        """See `Sink.write`.

        Raises:
            SessionError: the store cannot be written.
        """
        if self._n_used < len(self._views):
            changes = [self._with_all_views(change) for change in changes]
        if edit is None:
            return self._store.commit(label, changes, by_program=True).edit
        self._store.amend(edit, changes, by_program=True)
        return edit

    def _with_all_views(self, change: PoseChange) -> PoseChange:
        """Return a row whose costs by view are those of all cameras; a row that was read from the store has them."""
        pose = change.pose
        if pose is None or len(pose.view_costs_px) != self._n_used:
            return change
        costs = tuple(None if v is None else pose.view_costs_px[v] for v in self._views)
        return replace(change, pose=replace(pose, view_costs_px=costs))


class TrackSession:
    """One run of a tracker and its results so far.

    `first_pass`, `backward_pass` and `smoothing` do the work in this order. Another thread than the one that reads
    results may drain them. Each step is handed to `take` before the next one is asked for: its caller holds whatever
    lock guards the results and the sink. A run stops where its steps are no longer asked for, and goes on where they
    are again.
    """

    def __init__(
        self,
        tracker: Tracker,
        run: TrackingRun,
        stored: Sequence[StoredPerson],
        sink: Sink,
        label: str,
        save_frames: int | None = None,
        tracked_before: Sequence[TrackedFrame] = (),
        rows_before: Mapping[int, TrackedRows] | None = None,
    ) -> None:
        """Prepare a run; no frame is read yet.

        Args:
            tracker: the method and its settings.
            run: what is tracked.
            stored: all people of the session.
            sink: where poses are saved.
            label: of the entry of the history.
            save_frames: frames after which `take` saves; None leaves that to calls of `save`.
            tracked_before: frames of an interrupted run of which this one is the rest, in the order of tracking.
            rows_before: their rows by person; this run adds its own.
        """
        self.tracker, self.run, self.label = tracker, run, label
        self._stored, self._sink, self._save_frames = stored, sink, save_frames
        self.tracked = {f.frame: f for f in tracked_before}
        """Frames tracked so far by their number, in the order of tracking."""
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
        self._rows = {i: (rows_before or {}).get(i, TrackedRows()) for i in run.subjects.tracked}
        self._waiting: list[PoseChange] = []
        self._n_waiting = 0
        self._edit: int | None = None

    def steps(self) -> Iterator[Step]:
        """Run both passes and smooth the poses."""
        yield from self.first_pass()
        yield from self.backward_pass()
        yield from self.smoothing()

    def first_pass(self) -> Iterator[PoseEstimate]:
        """Track the frames."""
        if self.run.frames:
            yield from self.tracker.estimates(self.run)

    def backward_pass(self) -> Iterator[BackwardStep]:
        """Improve frames on which people were lost, in this run or before it was interrupted."""
        yield from self.tracker.backward_pass(self.run, list(self.tracked.values()))

    def smoothing(self) -> Iterator[SmoothedRows]:
        """Smooth the poses of all people; a single step, so that a run is smoothed as a whole or not at all."""
        if self.tracker.settings.smooth:
            subjects = self.run.subjects
            found = (rows.finished(subjects, person, self.run.fps) for person, rows in self._rows.items())
            yield SmoothedRows(tuple(change for changes in found for change in changes))
        self.finished = True

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
        self._waiting += self._rows_of([step], self.run.subjects.tracked)
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
        done = len(self.costs_px)
        return self.run.frames[done] if done < len(self.run.frames) else None

    def rows_record(self) -> dict[str, Any]:
        """Return the covariances and features with which a resumed run smooths the frames of this one."""
        return {str(person): rows.record() for person, rows in self._rows.items()}

    def status_counts(self) -> list[Counter[Status]]:
        """Return how often each person had which status on the frames of this run."""
        of_frames = [self.tracked[k].statuses for k in self.costs_px]
        return [Counter(s[i] for s in of_frames) for i in range(len(self._stored))]

    def _take_improved(self, step: BackwardStep) -> None:
        self.save()
        self.visited = step.frame
        for found in step.better:
            self.tracked[found.frame] = TrackedFrame.of(found)
            if found.frame in self.costs_px:
                self.costs_px[found.frame] = found.cost_px
        self.n_improved += len(step.better)
        self._write(self._rows_of(step.better, [step.person]))

    def _take_finished(self, step: SmoothedRows) -> None:
        self.save()
        for i, person in enumerate(self._stored):
            statuses = {c.frame: c.pose.status for c in step.changes if c.person == person.name and c.pose is not None}
            for frame in statuses.keys() & self.tracked.keys():
                self.tracked[frame] = self.tracked[frame].with_status(i, status_named(statuses[frame]))
        self._write(step.changes)
        self.finished = True

    def _rows_of(self, found: Sequence[PoseEstimate], people: Sequence[int]) -> list[PoseChange]:
        """Return the rows of estimates, and keep them for smoothing."""
        keyframes, settings = self.run.subjects.keyframes, self.tracker.settings
        changes: list[PoseChange] = []
        for estimate in found:
            for person in people:
                rows = tracked_changes([estimate], self._stored, [person], keyframes, settings)
                for change in rows:
                    self._rows[person].add(change, estimate.covariances[person], estimate.qualities[person])
                changes += rows
        return changes

    def _write(self, changes: Sequence[PoseChange]) -> None:
        if changes:
            self._edit = self._sink.write(self.label, changes, self._edit)
