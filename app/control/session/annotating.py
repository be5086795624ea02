"""The plan of annotation: plan tasks, decide on them, and comment."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.runtime.jobs import LatestWinsWorker
from app.state.state import State
from tracker.annotation.frame_choice import FrameChoice, choose_frames, dealt
from tracker.annotation.plan import (
    add_comment,
    add_tasks,
    decide,
    read_comments,
    read_tasks,
    require_seen,
    resolve_comment,
)
from tracker.annotation.speed import measure_speed
from tracker.body.limbs import limbs
from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.annotator import checked_annotator
from tracker.session.store.records import MarkChange
from tracker.session.store.task_log import State as Decision

T = TypeVar("T")

_LOG = logging.getLogger(__name__)
_REST_S = 0.3
"""Minimum time between two readings of the plan: a tracker writes twice a second."""
MAX_OPEN_COMMENTS = 500
"""Open comments of one participant: more than a host reads in a day. Each page receives all after a change."""


class Annotating:
    """Tasks and comments of one session. The state follows what is stored, in the background."""

    def __init__(self, session_state: SessionState, activities: Activities, reader: "Annotating | None" = None) -> None:
        """Read the plan.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before a pose is marked.
            reader: reads the plan for everybody who works on the session; None for the host's own part.
        """
        self._session_state, self._activities = session_state, activities
        self._reader = reader or self
        author = session_state.saver.author
        session_state.set(annotation=replace(session_state.state.annotation, author=author))
        if reader is not None:
            return
        self._reading = threading.Lock()  # the last reading that begins is the last one shown
        self._latest: LatestWinsWorker[int] = LatestWinsWorker(self._read, "plan of annotation", _REST_S)
        session_state.subscribe(self._changed, "timeline_version")
        self._changed(session_state.state)

    def close(self) -> None:
        """End the thread."""
        if self._reader is self:
            self._latest.close()

    def plan(self, choice: FrameChoice, person: int | None, names: Sequence[str], each: bool) -> int:
        """Plan tasks; those that are planned already stay. Returns the number of new ones.

        Args:
            choice: of the frames.
            person: index; None for everybody.
            names: of the annotators; empty for anybody.
            each: whether each annotator has all frames; else they are dealt out in turns.

        Raises:
            TrackerError: frames or names are none, or there are no poses to choose from.
        """
        session = self._session_state.session
        people = session.people if person is None else session.people[person : person + 1]
        to = list(dict.fromkeys(map(checked_annotator, names)))
        wishes = [(one.name, *pair) for one in people for pair in dealt(choose_frames(session, one, choice), to, each)]
        added = self._write(lambda store, author: add_tasks(store, wishes, author))
        if not added:
            why = "none of them exists" if not wishes else "all of them are planned already"
            raise TrackerError(f"expected frames to plan, found that {why}; choose others")
        return added

    def verify(self, person: int, frame: int, seen: str = "") -> None:
        """Verify the tasks of a person on a frame. The pose stays; one that is no keyframe is marked as reviewed.

        Args:
            person: index of the person.
            frame: of the pose.
            seen: identity of the pose that the reviewer saw; empty for the present one.

        Raises:
            TrackerError: there is no task or no pose, it has changed since, or an edit cannot be written.
        """
        session_state, name = self._session_state, self._session_state.session.people[person].name
        with self._activities.editing():
            session_state.saver.retry()
            require_seen(session_state.saver.store, (name, frame), seen, session_state.saver.author)
            record = session_state.saver.record(person, frame)
            is_planned = any((t.row.person, t.row.frame) == (name, frame) for t in session_state.state.annotation.tasks)
            if record is not None and is_planned and not record.keyframe and not record.reviewed:
                label = session_state.label_of(f"Verify, frame {frame}", person)
                mark = MarkChange(name, frame, keyframe=False, reviewed=True)
                session_state.saver.write(label, [mark], None, by_program=False)
                session_state.note_moved()
                session_state.show_frame()
                session_state.refresh_saving()
        self._decide(name, frame, "verified", seen=seen)

    def reject(self, person: int, frame: int, comment: str, seen: str = "") -> None:
        """Reject the tasks of a person on a frame, with the reason; see `verify`.

        Raises:
            TrackerError: there is no task or no reason, the pose has changed since, or it cannot be written.
        """
        if not comment.strip():
            raise TrackerError("expected the reason of the rejection, found none; write what is to be corrected")
        name = self._session_state.session.people[person].name
        self._decide(name, frame, "rejected", comment.strip(), seen)

    def withdraw(self, person: int, frame: int) -> None:
        """Take the tasks of a person on a frame out of the plan.

        Raises:
            TrackerError: there is no task, or it cannot be written.
        """
        self._decide(self._session_state.session.people[person].name, frame, "withdrawn")

    def comment(self, person: int, frame: int, limb: int | None, text: str) -> None:
        """Comment on a person on a frame.

        Args:
            person: index of the person.
            frame: within the recording.
            limb: index among `tracker.body.limbs.limbs`; None for the whole body.
            text: the comment.

        Raises:
            TrackerError: the text is empty, there is no such limb, it cannot be written, or a participant has too many.
        """
        author, stored = self._session_state.saver.author, self._session_state.state.annotation.comments
        n_open = sum(c.row.author == author and not c.resolved for c in stored)
        if self._reader is not self and n_open >= MAX_OPEN_COMMENTS:
            raise TrackerError(
                f"expected at most {MAX_OPEN_COMMENTS} open comments of one participant, found as many of {author}; "
                "resolve some before you write others"
            )
        one = self._session_state.session.people[person]
        known = limbs(one.model)
        if limb is not None and limb >= len(known):
            raise TrackerError(f"expected one of the {len(known)} limbs of {one.name}, found number {limb}; reload")
        name = "" if limb is None else known[limb].name
        self._write(lambda store, author: add_comment(store, (one.name, frame), text, name, author))

    def resolve(self, uid: str, resolved: bool) -> None:
        """Resolve a comment, or open it again.

        Raises:
            TrackerError: there is no such comment, or it cannot be written.
        """
        self._write(lambda store, author: resolve_comment(store, uid, resolved, author))

    def _decide(self, person: str, frame: int, decision: Decision, comment: str = "", seen: str = "") -> None:
        self._write(lambda store, author: decide(store, (person, frame), decision, comment, author=author, seen=seen))

    def _write(self, write: Callable[[AnnotationStore, str], T]) -> T:
        """Write rows of the plan, and show them."""
        saver = self._session_state.saver
        with self._session_state.lock:
            found = write(saver.store, saver.author)
        self._reader.read()
        return found

    def read(self) -> None:
        """Read the plan into the state; those who follow the host take it over."""
        self._read(0)

    def _changed(self, state: State) -> None:
        self._latest.offer(state.timeline_version)

    def _read(self, _: int) -> None:
        """Read the plan into the state."""
        with self._reading:
            self._show()

    def _show(self) -> None:
        saver = self._session_state.saver
        try:
            has_tasks = bool(saver.store.tasks.tasks())
            tasks = tuple(t for t in read_tasks(saver.store) if t.state != "withdrawn") if has_tasks else ()
            comments = tuple(read_comments(saver.store))
            speeds = tuple(measure_speed(saver.store)) if tasks else ()
        except TrackerError as error:  # its drive may be gone: the plan as it was stays
            _LOG.warning("the plan cannot be read: %s", error)
            return
        with self._session_state.lock:
            before = self._session_state.state.annotation
            after = replace(before, author=saver.author, tasks=tasks, comments=comments, speeds=speeds)
            if (after.author, after.tasks, after.comments, after.speeds) != (
                before.author, before.tasks, before.comments, before.speeds
            ):  # fmt: skip
                self._session_state.set(annotation=after)
