"""`quadrille tasks`: list the tasks of a plan and decide on them; comments."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.annotation.task_report import format_comments, format_plan, record, speed_record
from app.cli.arguments import OptionalName, OptionalWhole, SessionArg
from app.cli.target import load_target
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
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
    from tracker.annotation.comments import read_comments
    from tracker.annotation.plan import read_tasks
    from tracker.annotation.speed import measure_speed
    from tracker.session.lock import SessionLock
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.annotator import one_form

    set_annotator(arguments.annotator)
    arguments = replace(arguments, of=None if arguments.of is None else one_form(arguments.of))
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
    from tracker.annotation.comments import add_comment, resolve_comment
    from tracker.annotation.plan import decide

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
