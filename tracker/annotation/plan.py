"""The plan of annotation: tasks, and their states.

A task is `draft` until its annotator sets a keyframe, and `annotated` from then on: both follow from the poses.
Verified, rejected and withdrawn are decisions of a person, stored with author, time and the pose that was seen. The
latest counts that holds: *verified* for this pose alone, *rejected* until the annotator has set another one.

Comments on a person in a frame and, optionally, on a limb.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.annotator import annotator
from tracker.session.store.edit_tree import now
from tracker.session.store.records import MarkChange, derived_uid, new_uid
from tracker.session.store.task_log import CommentRow, MadePose, PlannedPose, State, StateRow, TaskRow, last_verdict

STATES: tuple[State, ...] = ("draft", "annotated", "verified", "rejected")
"""States of the tasks that are not withdrawn, in the order in which they are counted."""


class Task(NamedTuple):
    """A frame of a person that is to be annotated, and how far it is."""

    row: TaskRow
    state: State
    comment: str
    """Reason of the last decision; empty where it no longer counts."""
    by: str
    """Name of the person who brought it to its state; empty for nobody."""
    time: str
    """Time since when it has its state, ISO 8601, UTC."""
    pose: str = ""
    """Identity of the present pose; empty without one."""


def add_tasks(store: AnnotationStore, wishes: Iterable[tuple[str, int, str]], author: str | None = None) -> int:
    """Plan tasks; those that are planned already stay as they are, and withdrawn ones return.

    Args:
        store: annotations of the session.
        wishes: person, frame and annotator (empty for anybody) of each task.
        author: of the plan; by default the annotator of this process.

    Returns:
        Number of tasks that were added or returned.
    """
    by, time = annotator() if author is None else author, now()
    known = {task.row.uid: task for task in read_tasks(store)}
    rows = [TaskRow(derived_uid("plan", *wish), "plan", *wish, by, time) for wish in dict.fromkeys(wishes)]
    back = [row for row in rows if row.uid in known and known[row.uid].state == "withdrawn"]
    added = [row for row in rows if row.uid not in known]
    store.tasks.add(added, [StateRow(new_uid(), row.uid, "draft", "", by, time) for row in back])
    return len(added) + len(back)


def read_tasks(store: AnnotationStore) -> list[Task]:
    """Return all tasks with their states, by person, frame and annotator; withdrawn ones too."""
    present = store.tasks.planned_poses()
    by_hand: dict[tuple[str, int, str], MadePose] = {}
    for made in store.tasks.keyframe_edits():
        by_hand[made.person, made.frame, made.author] = by_hand[made.person, made.frame, ""] = made
    decided: dict[str, list[StateRow]] = defaultdict(list)
    for state in store.tasks.states():
        decided[state.task].append(state)
    return [
        _task(row, present, by_hand, decided[row.uid])._replace(
            pose=present[row.person, row.frame].uid if (row.person, row.frame) in present else ""
        )
        for row in store.tasks.tasks()
    ]


def _task(
    row: TaskRow,
    present: Mapping[tuple[str, int], PlannedPose],
    by_hand: Mapping[tuple[str, int, str], MadePose],
    decided: Sequence[StateRow],
) -> Task:
    pose = present.get((row.person, row.frame))
    made = by_hand.get((row.person, row.frame, row.annotator)) if pose is not None and pose.keyframe else None
    plain = Task(row, "draft", "", "", row.time)
    if made is not None and (row.kind == "plan" or made.time > row.time):
        plain = Task(row, "annotated", "", made.author, made.time)
    verdict = last_verdict(decided, pose)
    for decision in reversed(decided):
        if decision.state == "draft":  # planned again
            break
        holds = {
            "withdrawn": True,
            "rejected": plain.state == "draft" or plain.time <= decision.time,
            "verified": decision is verdict,
        }
        if holds.get(decision.state, False):
            return Task(row, decision.state, decision.comment, decision.author, decision.time)
        if decision is verdict:  # it overrules earlier ones
            break
    return plain


def is_disputed(store: AnnotationStore, person: str, frame: int) -> bool:
    """Return whether two merged copies disagree about the pose of a person, and nobody has decided it yet."""
    at = ("disagreement", person, frame)
    if all((row.kind, row.person, row.frame) != at for row in store.tasks.tasks()):
        return False
    return any((t.row.kind, t.row.person, t.row.frame) == at and t.state == "rejected" for t in read_tasks(store))


def count_states(tasks: Sequence[Task]) -> dict[str, int]:
    """Return the number of tasks in each of `STATES`, and their `total` without withdrawn ones."""
    n_tasks = Counter(task.state for task in tasks)
    counts: dict[str, int] = {state: n_tasks[state] for state in STATES}
    return counts | {"total": sum(counts.values())}


def decide(
    store: AnnotationStore,
    at: tuple[str, int],
    state: State,
    comment: str = "",
    of: str | None = None,
    author: str | None = None,
    seen: str = "",
) -> int:
    """Verify, reject or withdraw the tasks of a person in a frame. A verified pose is marked as reviewed, too.

    Args:
        store: annotations of the session.
        at: person and frame.
        state: `verified`, `rejected` or `withdrawn`.
        comment: for the annotator.
        of: decide on the tasks of this annotator alone; None for all.
        author: of the decision; by default the annotator of this process.
        seen: identity of the pose that it is about; empty for the present one, whatever it is.

    Returns:
        Number of tasks.

    Raises:
        TrackerError: no task is there, there is no pose to verify, or it is another than the one that was seen.
    """
    person, frame = at
    tasks = [t.row for t in read_tasks(store) if (t.row.person, t.row.frame) == at and t.state != "withdrawn"]
    rows = [row for row in tasks if of is None or row.annotator == of]
    if not rows:
        raise TrackerError(f"expected a task of {person} in frame {frame}, found none; plan the frame first")
    by = annotator() if author is None else author
    require_seen(store, at, seen, by)
    if state == "verified":
        pose = store.pose(person, frame)
        if pose is None:
            raise TrackerError(f"expected a pose of {person} in frame {frame} to verify, found none; annotate it first")
        if not pose.keyframe and not pose.reviewed:
            store.commit(f"Verify frame {frame}", [MarkChange(person, frame, keyframe=False, reviewed=True)])
    shown = store.tasks.planned_poses().get(at)
    time, pose_uid = now(), None if shown is None else shown.uid
    store.tasks.add(states=[StateRow(new_uid(), row.uid, state, comment, by, time, pose_uid) for row in rows])
    return len(rows)


def require_seen(store: AnnotationStore, at: tuple[str, int], seen: str, by: str) -> None:
    """Check that the present pose is the one that a reviewer has seen, or one that the reviewer made since.

    Args:
        store: annotations of the session.
        at: person and frame.
        seen: identity of the pose that was seen; empty for any.
        by: name of the reviewer.

    Raises:
        TrackerError: it is another one.
    """
    shown = store.tasks.planned_poses().get(at) if seen else None
    if shown is not None and shown.uid != seen and shown.author != by:
        raise TrackerError(
            f"expected the pose of {at[0]} in frame {at[1]} that you have seen, found another one by "
            f"{shown.author or 'nobody named'}; look at it, then decide"
        )


class Comment(NamedTuple):
    """A comment, and whether it is resolved."""

    row: CommentRow
    resolved: bool
    resolved_by: str
    """Name of the person who resolved it; empty while it is open."""


def add_comment(
    store: AnnotationStore, at: tuple[str, int], text: str, limb: str = "", author: str | None = None
) -> str:
    """Comment on a person in a frame; returns the identity of the comment.

    Args:
        store: annotations of the session.
        at: person and frame.
        text: the comment.
        limb: name of a limb (`tracker.body.limbs`); empty for the whole body.
        author: of the comment; by default the annotator of this process.

    Raises:
        TrackerError: the text is empty.
    """
    if not text.strip():
        raise TrackerError("expected a comment, found an empty text; write what is to be done")
    row = CommentRow(new_uid(), "", *at, limb, text.strip(), 0, _by(author), now())
    store.tasks.add(comments=[row])
    return row.uid


def resolve_comment(store: AnnotationStore, start: str, resolved: bool = True, author: str | None = None) -> Comment:
    """Resolve a comment, or open it again; returns it as it was.

    Args:
        store: annotations of the session.
        start: its identity, or enough of its first digits.
        resolved: False opens it again.
        author: of the change; by default the annotator of this process.

    Raises:
        TrackerError: no comment or several begin so.
    """
    named = [comment for comment in read_comments(store) if start and comment.row.uid.startswith(start)]
    if len(named) != 1:
        raise TrackerError(
            f"expected the first digits of one comment, found {len(named)} that begin with '{start}'; list the comments"
        )
    row = named[0].row
    change = row._replace(uid=new_uid(), about=row.uid, text="", resolved=int(resolved), author=_by(author), time=now())
    store.tasks.add(comments=[change])
    return named[0]


def read_comments(store: AnnotationStore) -> list[Comment]:
    """Return all comments, earliest first; of changes of one comment the last one counts."""
    rows = store.tasks.comments()
    last = {row.about: row for row in rows if row.about}
    return [
        Comment(row, bool(state and state.resolved), state.author if state and state.resolved else "")
        for row in rows
        if not row.about
        for state in [last.get(row.uid)]
    ]


def _by(author: str | None) -> str:
    return annotator() if author is None else author
