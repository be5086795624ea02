"""`quadrille body`: move a person to another body, such as one with feet."""

from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from app.cli.arguments import OptionalName, SessionArg
from app.cli.target import Target, load_target
from app.runtime.json_output import format_json


@dataclass(frozen=True)
class BodyArguments:
    """Arguments of `quadrille body`."""

    session: SessionArg
    """session folder."""
    to: str
    """preset, such as gavrila38, or a body model file."""
    person: OptionalName = None
    """name; optional in a session of one person."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[BodyArguments, tyro.conf.arg(name="")]) -> None:
    """Move a person to another body, such as one with feet.

    Keeps the height and the sizes of all parts that both bodies have. Keyframes and found poses are fitted to their
    joints in space; tracked poses keep the former body until they are tracked again. One entry of the history: the page
    undoes it.
    """
    found = move_to(load_target(arguments.session, arguments.person, several=False), arguments.to)
    print(format_json(found) if arguments.json else _format(found))


def move_to(at: Target, to: str) -> dict[str, Any]:
    """Move one person to another body.

    Returns:
        `person`, `before` and `after` as names of bodies, `height_m`, `refitted` and `kept` as numbers of poses, and
        `off_mm`, the mean distance of the joints of refitted poses.

    Raises:
        TrackerError: there is no such body, or the person has it.
    """
    from tracker.pipeline.body_change import change_body
    from tracker.session.lock import SessionLock
    from tracker.session.store.annotation_store import AnnotationStore

    session, (person,) = at
    with SessionLock(session.folder), AnnotationStore(session.annotations_path) as store:
        found = change_body(session, store, person, to)
    return {
        "person": session.people[person].name,
        "before": session.people[person].model.name,
        "after": found.body.name,
        "height_m": found.body.height_m,
        "refitted": found.n_refitted,
        "off_mm": 1000 * found.off_m,
        "kept": found.n_kept,
    }


def _format(found: dict[str, Any]) -> str:
    n, kept = found["refitted"], found["kept"]
    refitted = (
        f"; {n} pose{'' if n == 1 else 's'} refitted, joints {found['off_mm']:.0f} mm off on average" if n else ""
    )
    lines = [f"{found['person']}: {found['before']} to {found['after']}, {found['height_m']:.2f} m tall{refitted}"]
    if kept:
        keep = "1 tracked pose keeps" if kept == 1 else f"{kept} tracked poses keep"
        lines.append(f"{keep} {found['before']}, which the page does not show beside {found['after']}; track again")
    return "\n".join(lines)
