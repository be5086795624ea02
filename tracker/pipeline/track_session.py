"""Drive one run of a tracker over a session: both passes, results, and saving as one entry of the history."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Protocol

from tracker.pipeline.tracked_changes import StoredPerson, tracked_changes
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import BackwardStep, PoseEstimate, TrackedFrame
from tracker.tracking.tracker import Tracker, TrackingRun

Step = PoseEstimate | BackwardStep
"""A step of a run: a tracked frame of the first pass, or a visit to a frame of the second."""


class Sink(Protocol):
    """Receives the poses of a run."""

    def write(self, label: str, changes: Sequence[PoseChange], edit: int | None) -> int | None:
        """Write poses, but leave keyframes as they are.

        Args:
            label: of the entry of the history.
            changes: at least one.
            edit: what the last call returned; None at the first.

        Returns:
            The entry of the history that further poses of the run are added to.
        """


class StoreSink:
    """Writes the poses of a run to a store at once."""

    def __init__(self, store: AnnotationStore) -> None:
        """Write to a store that is open."""
        self._store = store

    def write(self, label: str, changes: Sequence[PoseChange], edit: int | None) -> int:
        """See `Sink.write`.

        Raises:
            SessionError: the store cannot be written.
        """
        if edit is None:
            return self._store.commit(label, changes, by_program=True).edit
        self._store.amend(edit, changes, by_program=True)
        return edit


class TrackSession:
    """One run of a tracker and its results so far.

    `first_pass` and `backward_pass` do the work, and may be drained by another thread than the one that reads results.
    Each step is handed to `take` before the next one is asked for: its caller holds whatever lock guards the results
    and the sink. A run stops where its steps are no longer asked for, and goes on where they are again.
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
        """
        self.tracker, self.run, self.label = tracker, run, label
        self._stored, self._sink, self._save_frames = stored, sink, save_frames
        self.tracked = {f.frame: f for f in tracked_before}
        """Frames tracked so far by their number, in the order of tracking."""
        self.costs_px: dict[int, float] = {}
        """Cost of each frame that this run has tracked, px."""
        self.n_improved = 0
        """Number of poses that the backward pass has replaced."""
        self.visited: int | None = None
        """The frame that the backward pass visited last; None before it."""
        self.finished = False
        """Whether both passes are done."""
        self._waiting: list[PoseEstimate] = []
        self._edit: int | None = None

    def steps(self) -> Iterator[Step]:
        """Run both passes."""
        yield from self.first_pass()
        yield from self.backward_pass()

    def first_pass(self) -> Iterator[PoseEstimate]:
        """Track the frames."""
        if self.run.frames:
            yield from self.tracker.estimates(self.run)

    def backward_pass(self) -> Iterator[BackwardStep]:
        """Improve frames on which people were lost, in this run or before it was interrupted."""
        yield from self.tracker.backward_pass(self.run, list(self.tracked.values()))
        self.finished = True

    def take(self, step: Step) -> None:
        """Keep the results of a step.

        What the backward pass improves is saved at once: a whole interval or nothing of it.
        """
        if isinstance(step, BackwardStep):
            self._take_improved(step)
            return
        self._waiting.append(step)
        self.tracked[step.frame] = TrackedFrame.of(step)
        self.costs_px[step.frame] = step.cost_px
        if self._save_frames is not None and len(self._waiting) >= self._save_frames:
            self.save()

    def save(self) -> None:
        """Save the frames that are not saved yet."""
        self._write(self._waiting, self.run.subjects.tracked)
        self._waiting.clear()

    @property
    def has_unsaved(self) -> bool:
        """Whether there are tracked frames that are not saved yet."""
        return bool(self._waiting)

    @property
    def next_frame(self) -> int | None:
        """The first frame that is not tracked yet; None where all are."""
        done = len(self.costs_px)
        return self.run.frames[done] if done < len(self.run.frames) else None

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
        self._write(step.better, [step.person])

    def _write(self, found: Sequence[PoseEstimate], people: Sequence[int]) -> None:
        keyframes, settings = self.run.subjects.keyframes, self.tracker.settings
        changes = tracked_changes(found, self._stored, people, keyframes, settings)
        if changes:
            self._edit = self._sink.write(self.label, changes, self._edit)
