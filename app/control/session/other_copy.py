"""Compare the session with another copy of it, and decide between the poses of both."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.other_copy import TOLERANCE_MM, CopyDifference, OtherCopy
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.evaluation.agreement.copies import (
    Subject,
    annotator_names,
    check_same_recording,
    farthest_joint,
    is_annotated,
    mean_pose,
    notes_on,
)
from tracker.geometry.arrays import Array
from tracker.session.session import Session, load_session
from tracker.session.store.records import TAKEN_FROM, Alternative, MarkChange, PoseChange, PoseRecord
from tracker.session.store.stored_poses import read_stored_poses

Decision = Literal["keep", "take", "mean"]
"""The own pose, that of the other copy, or the mean of both."""
_Pairs: TypeAlias = dict[int, tuple[PosedBody, PosedBody]]
"""Poses of one person in this session and in the copy, by frame."""
_REST_S = 0.3
"""Minimum time between two comparisons: a drag is written once a second."""


class OtherCopies:
    """Compares with one copy at a time. The comparison follows every edit; the copy is read once, and never changed."""

    def __init__(
        self, session_state: SessionState, activities: Activities, assess: Callable[[PoseChange, int | None], None]
    ) -> None:
        """Compare nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
            assess: called with each row that was stored and its edit, None where it waits to be written.
        """
        self._session_state, self._activities, self._assess = session_state, activities, assess
        self._latest: LatestWinsWorker[None] = LatestWinsWorker(self._refresh, "comparison of copies", _REST_S)
        self._compared = session_state.state.timeline_version
        session_state.subscribe(self._changed, "timeline_version")

    def open(self, folder: Path) -> None:
        """Compare with the copy in a folder.

        Raises:
            TrackerError: it is no copy of the session, or its poses cannot be read.
        """
        own, other = self._session_state.session, load_session(folder)
        check_same_recording([own, other])
        own_name, name = annotator_names([own.folder, other.folder])
        poses, annotated = [], []
        for person in own.people:
            model = next(p.model for p in other.people if p.name == person.name)
            stored = read_stored_poses(other.annotations_path, person.name, model)
            poses.append({frame: found.body for frame, found in stored.items()})
            annotated.append(frozenset(f for f, p in stored.items() if is_annotated(p.record.keyframe, p.source)))
        copy = OtherCopy(name, own_name, tuple(poses), tuple(annotated), ((),) * len(poses), TOLERANCE_MM / 1000)
        with self._session_state.lock:
            self._compared = self._session_state.state.timeline_version
            pairs = [self._pairs(copy, person, frames) for person, frames in enumerate(annotated)]
            self._session_state.set(
                other_copy=replace(copy, differences=tuple(map(_farthest, pairs)), notes=self._notes(other, pairs))
            )

    def leave(self) -> None:
        """End the comparison."""
        self._session_state.set(other_copy=None)

    def set_tolerance(self, tolerance_m: float) -> None:
        """Set the distance of a joint, metres, up to which two poses count as one."""
        with self._session_state.lock:
            if (copy := self._session_state.state.other_copy) is not None:
                self._session_state.set(other_copy=replace(copy, tolerance_m=tolerance_m))

    def decide(self, person: int, frame: int, decision: Decision) -> None:
        """Keep the own pose, take that of the other copy, or take the mean of both; the result is a keyframe.

        A pose that is replaced becomes the first alternative. One step of undo takes the decision back.

        Args:
            person: index of the person.
            frame: the frame that the user saw.
            decision: which pose.

        Raises:
            TrackerError: no copy is compared, or a pose is missing on the frame.
        """
        session_state = self._session_state
        with self._activities.editing():
            session_state.go_to(frame)
            copy = session_state.state.other_copy
            if copy is None:
                raise TrackerError("expected another copy to compare with, found none; open one first")
            own = session_state.saver.record(person, frame)
            other = copy.poses[person].get(frame)
            name = session_state.session.people[person].name
            if other is None and decision != "keep":
                raise TrackerError(
                    f"expected a pose of {name} on frame {frame} in {copy.name}, found none; go to another frame"
                )
            if own is None and decision != "take":
                raise TrackerError(
                    f"expected a pose of {name} on frame {frame} in this session, found none; take that of {copy.name}"
                )
            change = self._change(person, frame, decision, copy)
            labels = {
                "keep": f"keep this pose against {copy.name}",
                "take": f"take the pose of {copy.name}",
                "mean": f"take the mean with {copy.name}",
            }
            label = f"{session_state.label_of(labels[decision], person)}, frame {frame}"
            edit = session_state.saver.write(label, [change], None, by_program=False)
            record = session_state.saver.record(person, frame)
            assert record is not None, "the decision has a pose"
            session_state.set(other_copy=replace(copy, decided={**copy.decided, (person, frame): record.values}))
            session_state.show_frame(frame=frame)
            session_state.refresh_saving()
        if isinstance(change, PoseChange):
            self._assess(change, edit)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def _change(self, person: int, frame: int, decision: Decision, copy: OtherCopy) -> PoseChange | MarkChange:
        saver, model = self._session_state.saver, self._session_state.present[person]
        name = self._session_state.session.people[person].name
        if decision == "keep":
            return MarkChange(name, frame, keyframe=True, reviewed=True)
        other = copy.poses[person][frame]
        values = retarget_pose(other.values, other.model, model)
        own = saver.record(person, frame)
        if decision == "mean":
            now = saver.pose_now(person, frame)
            if now is None:
                raise TrackerError(
                    f"expected a pose of the present body of {name} on frame {frame}, found one with other angles; "
                    "place it again first"
                )
            values = mean_pose(model, [now, values])
        origin = copy.name if decision == "take" else f"the mean of {copy.own_name} and {copy.name}"
        sources, settings = ("manual",) * len(values), {TAKEN_FROM: origin}
        record = PoseRecord(values, sources, saver.revisions.current(person), True, settings=settings, reviewed=True)
        back = () if own is None else (Alternative(own.values, own.model_revision, own.cost_px),)
        return PoseChange(name, frame, record, (*back, *saver.alternatives(person, frame)))

    def _changed(self, state: State) -> None:
        if state.other_copy is not None and state.timeline_version != self._compared:
            self._latest.offer(None)

    def _refresh(self, _: None) -> None:
        """Compare the frames again whose poses changed."""
        session_state = self._session_state
        with session_state.lock:
            state, copy = session_state.state, session_state.state.other_copy
            if copy is None or state.timeline_version == self._compared:
                return
            changed = frozenset(session_state.saver.index.timeline(self._compared))
            self._compared = state.timeline_version
            differences = tuple(
                _updated(old, changed, self._differences(copy, person, copy.annotated[person] & changed))
                for person, old in enumerate(copy.differences)
            )
            decided = {at: v for at, v in copy.decided.items() if at[1] not in changed or self._is_now(*at, v)}
            session_state.set(other_copy=replace(copy, differences=differences, decided=decided))

    def _is_now(self, person: int, frame: int, values: Array) -> bool:
        record = self._session_state.saver.record(person, frame)
        return record is not None and np.array_equal(record.values, values)

    def _differences(self, copy: OtherCopy, person: int, frames: frozenset[int]) -> tuple[CopyDifference, ...]:
        """Compare the poses of a person on those of some frames that this session has annotated, too."""
        return _farthest(self._pairs(copy, person, frames))

    def _pairs(self, copy: OtherCopy, person: int, frames: frozenset[int]) -> _Pairs:
        """Return the poses of both copies, by frame, where this session has annotated the person, too."""
        saver, out = self._session_state.saver, dict[int, tuple[PosedBody, PosedBody]]()
        for row in saver.rows(person, range(min(frames), max(frames) + 1)) if frames else ():
            if row.frame in frames and is_annotated(row.keyframe, row.source):
                record = saver.record(person, row.frame)
                if record is not None:
                    own = PosedBody(saver.revisions.body(record.model_revision), record.values)
                    out[row.frame] = own, copy.poses[person][row.frame]
        return out

    def _notes(self, other: Session, pairs: Sequence[_Pairs]) -> tuple[str, ...]:
        """Return sentences on what else differs between both copies, where they are compared."""
        own = self._session_state.session
        people = zip(own.people, pairs, strict=True)
        return notes_on([own, other], {Subject(p.name, f): bodies for p, of in people for f, bodies in of.items()})


def _farthest(pairs: _Pairs) -> tuple[CopyDifference, ...]:
    """Return the joint that lies farthest apart in each pair of poses; none where the bodies share no joint."""
    farthest = ((frame, farthest_joint(*bodies)) for frame, bodies in pairs.items())
    return tuple(CopyDifference(frame, *joint) for frame, joint in farthest if joint is not None)


def _updated(
    old: Iterable[CopyDifference], changed: frozenset[int], new: Iterable[CopyDifference]
) -> tuple[CopyDifference, ...]:
    """Return differences with those of changed frames replaced, ascending by frame."""
    return tuple(sorted((*(d for d in old if d.frame not in changed), *new)))
