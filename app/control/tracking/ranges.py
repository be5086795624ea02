"""Interpolate, clear, mark, track or estimate a range of frames; each is one entry of the history."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.control.tracking import track_settings
from app.control.tracking.comparing_runs import nothing_replaced
from app.control.tracking.range_changes import AT_ONCE, Mark, edited, interpolated, marked
from app.control.tracking.tracking import Tracking
from app.remedies import page_text
from app.runtime.jobs import Job
from app.state.progress import RangeState
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.pipeline.audit import AuditPlan, PoseAudit
from tracker.session.store.records import AssessmentChange, Change, FrameRow, PoseChange, PoseRecord

Step = Sequence[Change] | float
"""Changes to write, or the share of the work before them that is done, 0 to 1."""


@dataclass(eq=False)
class _Run:
    """Work on one range."""

    label: str
    """Label of the entry of the history."""
    did: str
    """Verb of the final message: `interpolated`."""
    by_program: bool
    """Whether keyframes stay unchanged."""
    before: Mapping[tuple[str, int], PoseRecord] = field(default_factory=dict)
    """Stored poses that slow work began with, by name and frame. A pose that changes meanwhile keeps the change."""
    job: Job[Step] = field(init=False)
    edit: int | None = None
    """Entry of the history; None before the first frames are written."""
    written: dict[str, set[int]] = field(default_factory=dict)
    """The frames written so far by the person's name."""


class Ranges:
    """Work on a range of frames, at most one at a time. A range is given by its first and last frame."""

    def __init__(self, session_state: SessionState, tracking: Tracking, activities: Activities) -> None:
        """Work on nothing yet.

        Args:
            session_state: holds the state.
            tracking: tracks within a range.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._tracking, self._activities = session_state, tracking, activities
        self._run: _Run | None = None
        activities.add_job(self, on_shown_frame=False)

    @property
    def running(self) -> bool:
        """Whether work is in progress."""
        return self._run is not None and self._run.job.running

    def interpolate(self, first: int, last: int, people: Sequence[int] | None = None) -> None:
        """Interpolate between the poses at the ends of a range and its keyframes, which stay unchanged.

        Args:
            first: first frame of the range.
            last: last frame of the range.
            people: indices of the people; None for all.

        Raises:
            TrackerError: no person has two poses with frames between them.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            gaps = [(i, *gap) for i in self._checked(people) for gap in self._gaps(i, first, last)]
            if not gaps:
                raise TrackerError(
                    f"expected poses at both ends of frames {first} to {last} and frames between them, found none; "
                    "set a pose at each end first"
                )
            poses = [(i, frame) for i, start, end in gaps for frame in range(start + 1, end)]
            changes = _pieces(change for gap in gaps for change in interpolated(self._session_state, *gap))
            run = _Run(self._label(f"interpolate frames {first} to {last}", people), "interpolated", by_program=True)
            self._begin(run, "interpolating", poses, changes)

    def clear(self, first: int, last: int, people: Sequence[int] | None = None) -> None:
        """Remove the poses of a range, except keyframes.

        Raises:
            TrackerError: there is no pose to remove.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            rows = [(i, row) for i, row in self._rows(first, last, people) if not row.keyframe]
            if not rows:
                raise TrackerError(
                    f"expected poses in frames {first} to {last} that are no keyframes, found none; "
                    "to clear keyframes too, remove their marks first"
                )
            changes = (PoseChange(self._name(i), row.frame, None) for i, row in rows)
            run = _Run(self._label(f"clear frames {first} to {last}", people), "cleared", by_program=True)
            self._begin(run, "clearing", [(i, row.frame) for i, row in rows], _pieces(changes))

    def mark(self, first: int, last: int, mark: Mark, people: Sequence[int] | None = None) -> None:
        """Mark the poses of a range.

        Raises:
            TrackerError: there is no pose to mark.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            rows = self._rows(first, last, people)
            if not rows:
                raise TrackerError(f"expected poses in frames {first} to {last} to mark, found none; set or track some")
            changes = {(i, row.frame): c for i, row in rows if (c := marked(self._name(i), row, mark)) is not None}
            where = f"frame {first}" if first == last else f"frames {first} to {last}"
            how = {"keyframe": "as keyframe", "none": "as no keyframe"}.get(mark, f"as {mark}")
            run = _Run(self._label(f"mark {where} {how}", people), "marked", by_program=False)
            self._begin(run, "marking", list(changes), _pieces(changes.values()))

    def edit_curves(
        self, first: int, last: int, person: int, dofs: Sequence[int], verb: str, amount: Array | float
    ) -> None:
        """Smooth or shift degrees of freedom of a person over a range; see `range_changes.edited`.

        Raises:
            TrackerError: nothing can change.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            changes = edited(self._session_state, person, range(first, last + 1), dofs, verb, amount)
            if not changes:
                raise TrackerError(
                    f"expected poses in frames {first} to {last} that can be {verb}ed, found none; "
                    "remove the marks of keyframes, or mark another range"
                )
            label = self._label(f"{verb} curves of frames {first} to {last}", [person])
            run = _Run(label, f"{verb}ed", by_program=False)
            self._begin(run, f"{verb}ing", [(person, c.frame) for c in changes], _pieces(changes))

    def estimate(self, first: int, last: int, people: Sequence[int] | None = None) -> None:
        """Estimate the poses of a range again from all its frames together; keyframes stay, nothing is tracked.

        All poses are written at the end.

        Raises:
            TrackerError: there is one camera, or no two frames in a row have poses.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            session_state, frames = self._session_state, range(first, last + 1)
            saver, state = session_state.saver, session_state.state
            posed = tuple(i for i in self._checked(people) if saver.index.within(i, frames))
            settings = track_settings.of_estimates(state.settings, state.run_choices)
            plan = AuditPlan(frames, posed or tuple(self._checked(people)), settings, replaces=True)
            audit = PoseAudit(session_state.session, saver.store, self._tracking.observer(), plan)
            before = {(self._name(i), frame): record for (i, frame), record in audit.records.items()}
            label = self._label(f"estimate frames {first} to {last}", people)
            run = _Run(label, "estimated", by_program=True, before=before)
            self._begin(
                run, "estimating", [at for at, record in audit.records.items() if not record.keyframe], _together(audit)
            )

    def take_replaced(self, first: int, last: int, people: Sequence[int] | None = None) -> None:
        """Put the poses back that those of a range replaced; keyframes stay. Doing it again takes the present ones.

        Raises:
            TrackerError: no pose of the range has replaced another.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            saver = self._session_state.saver
            changes = {
                (i, frame): PoseChange(self._name(i), frame, replace(other, keyframe=False))
                for i in self._checked(people)
                for frame, (now, other) in saver.replaced(i, range(first, last + 1)).items()
                if not now.keyframe
            }
            if not changes:
                raise nothing_replaced(first, last)
            label = self._label(f"take the other poses of frames {first} to {last}", people)
            run = _Run(label, "exchanged", by_program=True)
            self._begin(run, "exchanging", list(changes), _pieces(changes.values()))

    def toggle_keyframe(self) -> None:
        """Make the shown pose of the selected person a keyframe, or remove the mark; a draft is stored."""
        state, saver = self._session_state.state, self._session_state.saver
        rows = saver.rows(state.person, range(state.frame, state.frame + 1))
        if rows:
            self.mark(state.frame, state.frame, "none" if rows[0].keyframe else "keyframe", [state.person])
            return
        with self._activities.editing():
            state = self._session_state.state
            values = state.poses[state.person]
            record = PoseRecord(
                values, ("manual",) * len(values), saver.revisions.current(state.person), keyframe=True, reviewed=True
            )
            change = PoseChange(self._name(state.person), state.frame, record)
            run = _Run(self._label(f"keyframe, frame {state.frame}", [state.person]), "marked", by_program=False)
            self._begin(run, "marking", [(state.person, state.frame)], iter([[change]]))

    def toggle_reviewed(self) -> None:
        """Mark the shown pose of the selected person as reviewed, or remove the mark."""
        state = self._session_state.state
        rows = self._session_state.saver.rows(state.person, range(state.frame, state.frame + 1))
        is_reviewed = bool(rows) and rows[0].reviewed
        self.mark(state.frame, state.frame, "unreviewed" if is_reviewed else "reviewed", [state.person])

    def track(self, first: int, last: int, backward: bool) -> None:
        """Track from one end of a range to the other, starting with the poses at that end.

        Raises:
            TrackerError: no person has a pose.
        """
        first, last = self._within(first, last)
        with self._activities.editing():
            begin, end = (last, first) if backward else (first, last)
            if self._session_state.state.frame != begin:
                self._session_state.show_frame(frame=begin)
            self._tracking.start(backward, end)

    def halt(self) -> None:
        """Stop the work; frames already written stay. The caller must not hold the lock: the last step takes it."""
        run = self._run
        if run is not None:
            run.job.stop()
            with self._session_state.lock:
                if self._run is run:
                    self._end(run, "stopped")

    def forget(self) -> None:
        """Do nothing: halted work has ended."""

    def stop(self) -> None:
        """Stop the work, see `halt`."""
        self.halt()

    def _begin(self, run: _Run, what: str, poses: Sequence[tuple[int, int]], steps: Iterator[Step]) -> None:
        """Write changes: a few before this returns, many or slow ones in the background.

        Args:
            run: the work, which begins.
            what: its kind, as text for the user.
            poses: person and frame of each change.
            steps: in the order in which they are done.

        Raises:
            TurnError: somebody else works on one of the poses.
            TrackerError: the changes cannot be made; those before stay.
        """
        frames: dict[int, list[int]] = {}
        for person, frame in poses:
            frames.setdefault(person, []).append(frame)
        for person, own in frames.items():
            self._session_state.require_editable([person], own)
        self._session_state.open_edit_owner = None
        ends = [k for own in frames.values() for k in (min(own), max(own))]
        within = range(min(ends), max(ends) + 1) if ends else range(0)
        self._session_state.set(ranges=RangeState(True, what, 0, len(poses), frozenset(frames), within))
        run.job = Job(
            lambda: steps, lambda step, _: self._take(run, step), lambda error: self._ended(run, error), lambda: None
        )
        self._run = run
        if len(poses) <= AT_ONCE and not run.before:
            try:
                for step in steps:
                    self._take(run, step)
            except TrackerError as error:
                self._end(run, f"stopped, because {page_text(error)}")
                raise
            self._end(run, "done")
        else:
            run.job.run()

    def _take(self, run: _Run, step: Step) -> None:
        session_state = self._session_state
        with session_state.lock:
            if run is not self._run:
                return
            ranges = session_state.state.ranges
            if isinstance(step, float):
                session_state.set(ranges=replace(ranges, done=int(step * ranges.total)))
                return
            piece = [change for change in step if self._stands(run, change)]
            run.edit = session_state.saver.write(run.label, piece, run.edit, run.by_program)
            for change in piece:
                if not isinstance(change, AssessmentChange):
                    run.written.setdefault(change.person, set()).add(change.frame)
            ranges = replace(ranges, done=_count(run))
            if any(c.frame == session_state.state.frame for c in piece):
                session_state.show_frame(ranges=ranges)
            else:
                session_state.set(ranges=ranges)
            session_state.refresh_saving()

    def _stands(self, run: _Run, change: Change) -> bool:
        """Return whether the pose that a change is about is as it was when the work began."""
        before = run.before.get((change.person, change.frame))
        if before is None:
            return True
        names = [p.name for p in self._session_state.session.people]
        now = self._session_state.saver.record(names.index(change.person), change.frame)
        return now is not None and now.values.tolist() == before.values.tolist()

    def _ended(self, run: _Run, error: Exception | None) -> None:
        with self._session_state.lock:
            if run is self._run:
                self._end(run, "done" if error is None else f"stopped, because {page_text(error)}")

    def _end(self, run: _Run, how: str) -> None:
        state = self._session_state.state.ranges
        n_people, n_frames = len(run.written), len(set().union(*run.written.values()))
        frames = "1 frame" if n_frames == 1 else f"{n_frames} frames"
        did = f"{run.did} {frames}" + (f" of {n_people} people" if n_people > 1 else "")
        if how != "done":
            unit = "frames" if n_people < 2 else "poses"
            did = f"{how}: {run.did} {_count(run)} of {state.total} {unit}"
        self._run = None
        run.job.discard()
        self._session_state.refresh_saving()
        self._session_state.set(ranges=RangeState(message=did))

    def _within(self, first: int, last: int) -> tuple[int, int]:
        """Return a range in ascending order, clipped to the recording."""
        first, last = sorted((first, last))
        end = self._session_state.session.n_frames - 1
        if last < 0 or first > end:
            raise TrackerError(f"expected frames from 0 to {end}, found {first} to {last}; mark another range")
        return max(0, first), min(last, end)

    def _checked(self, people: Sequence[int] | None) -> Sequence[int]:
        indices = range(len(self._session_state.models))
        if people is not None and not set(people) <= set(indices):
            raise TrackerError(f"expected people from 0 to {indices[-1]}, found {list(people)}; reload the page")
        return indices if people is None else people

    def _rows(self, first: int, last: int, people: Sequence[int] | None) -> list[tuple[int, FrameRow]]:
        return [
            (i, row) for i in self._checked(people) for row in self._session_state.saver.rows(i, range(first, last + 1))
        ]

    def _label(self, label: str, people: Sequence[int] | None) -> str:
        return self._session_state.label_of(label, people[0] if people is not None and len(people) == 1 else None)

    def _name(self, person: int) -> str:
        return self._session_state.session.people[person].name

    def _gaps(self, person: int, first: int, last: int) -> Iterator[tuple[int, int]]:
        """Return pairs of successive fixed frames that have other frames between them."""
        rows = self._session_state.saver.rows(person, range(first, last + 1))
        stay = [row.frame for row in rows if row.keyframe or row.frame in (first, last)]
        return ((a, b) for a, b in pairwise(stay) if b - a > 1)


def _count(run: _Run) -> int:
    """Return how many poses are written."""
    return sum(map(len, run.written.values()))


def _together(audit: PoseAudit) -> Iterator[Step]:
    """Do the work of an estimate, and write all its poses at once."""
    rows = yield from audit.steps()
    yield rows


def _pieces(changes: Iterable[Change]) -> Iterator[Step]:
    """Split changes into pieces that are written at once."""
    piece: list[Change] = []
    for change in changes:
        piece.append(change)
        if len(piece) == AT_ONCE:
            yield piece
            piece = []
    if piece:
        yield piece
