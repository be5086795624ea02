"""`quadrille tasks`: list the tasks of a plan and decide on them; comments.

Report tasks and comments: as a JSON object, and as text.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalWhole, SessionArg
from app.cli.target import load_target
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.annotation.plan import Comment, Task
    from tracker.annotation.speed import Speed
    from tracker.session.session import Session
    from tracker.session.store.annotation_store import AnnotationStore


_Text = Annotated[str | None, tyro.conf.arg(metavar="TEXT", help_behavior_hint="")]


@dataclass(frozen=True)
class TasksArguments:
    """Arguments of `quadrille tasks`."""

    session: SessionArg
    """session folder."""
    person: OptionalName = None
    """name; optional in a session of one person. The list is of everybody without it."""
    frame: OptionalWhole = None
    """the frame to decide or comment on."""
    of: OptionalName = None
    """the annotator whose tasks are listed or decided on; by default all."""
    verify: bool = False
    """the pose is right."""
    reject: _Text = None
    """the pose is to be corrected, with the reason."""
    withdraw: bool = False
    """the frame need not be annotated."""
    comment: _Text = None
    """comment on the person in the frame."""
    limb: OptionalName = None
    """limb that --comment is about, such as left_forearm."""
    resolve: _Text = None
    """first digits of a comment that is done."""
    annotator: OptionalName = None
    """your name; remembered."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[TasksArguments, tyro.conf.arg(name="")]) -> None:
    """List the tasks of a plan with their states, or verify, reject, withdraw and comment.

    Tasks are planned by quadrille assign. docs/annotation.md describes their states.
    """
    from app.session.annotator import set_annotator
    from tracker.annotation.plan import read_comments, read_tasks
    from tracker.annotation.speed import measure_speed
    from tracker.session.lock import SessionLock
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.annotator import normalized_annotator

    set_annotator(arguments.annotator)
    arguments = replace(arguments, of=None if arguments.of is None else normalized_annotator(arguments.of))
    deeds = [
        w for w in ("verify", "reject", "withdraw", "comment", "resolve") if getattr(arguments, w) not in (None, False)
    ]
    if len(deeds) > 1:
        raise TrackerError(f"expected one thing to do, found --{' and --'.join(deeds)}; do them in turn")
    at = load_target(arguments.session, arguments.person, several=not deeds or deeds == ["resolve"])
    path = at.session.annotations_path
    if deeds:
        with SessionLock(at.session.folder), AnnotationStore(path) as store:
            _do(deeds[0], at.session, store, at.people[0], arguments)
    if not path.exists():
        raise TrackerError(f"expected a plan in {at.session.folder}, found no annotations; run quadrille assign first")
    names = {at.session.people[i].name for i in at.people}
    with AnnotationStore(path, read_only=True) as store:
        tasks = [t for t in read_tasks(store) if t.row.person in names and arguments.of in (None, t.row.annotator)]
        comments = [c for c in read_comments(store) if c.row.person in names]
        speed = speed_record(measure_speed(store)) if arguments.json else {}
    if arguments.json:
        print(format_json({**record(tasks, comments), "speed": speed}))
    else:
        print("\n".join(filter(None, (format_comments(comments), format_plan(tasks)))))


def _do(deed: str, session: "Session", store: "AnnotationStore", person: int, arguments: TasksArguments) -> None:
    from tracker.annotation.plan import add_comment, decide, resolve_comment

    if deed == "resolve":
        resolve_comment(store, arguments.resolve or "")
        return
    frame = arguments.frame
    if frame is None or not 0 <= frame < session.n_frames:
        raise TrackerError(
            f"expected --frame from 0 to {session.n_frames - 1} with --{deed}, found {frame}; name the frame"
        )
    at = (session.people[person].name, frame)
    if deed == "comment":
        add_comment(store, at, arguments.comment or "", _limb(session, person, arguments.limb))
    elif deed == "verify":
        decide(store, at, "verified", of=arguments.of)
    elif deed == "withdraw":
        decide(store, at, "withdrawn", of=arguments.of)
    else:
        if not (arguments.reject or "").strip():
            raise TrackerError("expected the reason with --reject, found an empty text; write what is to be corrected")
        decide(store, at, "rejected", arguments.reject or "", of=arguments.of)


def _limb(session: "Session", person: int, name: str | None) -> str:
    """Return the name of a limb, checked; empty for none."""
    from tracker.body.limbs import limbs

    known = [limb.name for limb in limbs(session.people[person].model)]
    if name is not None and name not in known:
        raise TrackerError(f"expected --limb as one of {', '.join(known)}, found '{name}'; choose one")
    return name or ""


_UID_DIGITS = 8
"""Digits of the identity of a comment that are shown: enough to tell thousands apart."""


def record(tasks: "Sequence[Task]", comments: "Sequence[Comment]") -> dict[str, Any]:
    """Return tasks, their counts and comments as a JSON object."""
    from tracker.annotation.plan import count_states

    return {
        "counts": count_states(tasks),
        "tasks": [
            {
                "uid": t.row.uid, "kind": t.row.kind, "person": t.row.person, "frame": t.row.frame,
                "annotator": t.row.annotator, "state": t.state, "comment": t.comment, "by": t.by, "time": t.time,
            }
            for t in tasks
            if t.state != "withdrawn"
        ],
        "comments": [
            {
                "uid": c.row.uid, "person": c.row.person, "frame": c.row.frame, "limb": c.row.limb, "text": c.row.text,
                "author": c.row.author, "time": c.row.time, "resolved": c.resolved, "resolved_by": c.resolved_by,
            }
            for c in comments
        ],
    }  # fmt: skip


def speed_record(speeds: "Sequence[Speed]") -> dict[str, dict[str, Any]]:
    """Return how quickly each person annotates and reviews, by name, as a JSON object."""
    return {
        s.name: {
            "verified": s.verified, "edits": s.edits, "seconds": s.edit_seconds,
            "seconds_per_verified": s.seconds_per_frame, "edits_per_verified": s.edits_per_frame,
            "decisions": s.decisions, "seconds_per_decision": s.seconds_per_decision,
        }
        for s in speeds
    }  # fmt: skip


def format_plan(tasks: "Sequence[Task]") -> str:
    """Format the plan, a line for each person, annotator and state, and the counts."""
    from tracker.annotation.plan import STATES, count_states

    counts = count_states(tasks)
    if not counts["total"]:
        return "no tasks are planned"
    open_tasks = [t for t in tasks if t.state != "withdrawn"]
    lines = []
    for (person, name), own in groupby(sorted(open_tasks, key=_owner), key=_owner):
        mine = list(own)
        lines.append(f"{person}, {name or 'anybody'}:")
        for state in STATES:
            frames = sorted({t.row.frame for t in mine if t.state == state})
            lines += [f"  {state:9} {len(frames):4}: {', '.join(map(str, frames))}"] if frames else []
    remarks = [
        f"{t.row.person}, frame {t.row.frame}: {t.comment} ({t.by or t.row.kind})" for t in open_tasks if t.comment
    ]
    return "\n".join([*lines, *remarks, f"{counts['verified']} of {counts['total']} verified"])


def format_comments(comments: "Sequence[Comment]") -> str:
    """Format the comments that are open, a line each; empty if there are none."""
    from tracker.body.limbs import limb_display_name  # imported lazily: it loads numpy

    lines = []
    for c in comments:
        limb = f", {limb_display_name(c.row.limb)}" if c.row.limb else ""
        at = f"{c.row.uid[:_UID_DIGITS]}  {c.row.person}, frame {c.row.frame}{limb}"
        lines += [] if c.resolved else [f"{at}: {c.row.text} ({c.row.author or 'nobody named'})"]
    return "\n".join(lines)


def _owner(task: "Task") -> tuple[str, str]:
    return task.row.person, task.row.annotator
