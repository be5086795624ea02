"""Report tasks and comments: as a JSON object, and as text."""

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracker.annotation.comments import Comment
    from tracker.annotation.plan import Task
    from tracker.annotation.speed import Speed

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
