"""`quadrille assign`: plan which frames are annotated by whom, and write blind copies."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.annotation.tasks import format_plan, record
from app.cli.arguments import Names, OptionalName, OptionalWhole, Paths, SessionArg
from app.cli.target import Target, load_target
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.annotation.plan import Task
    from tracker.session.session import Session
    from tracker.session.store.annotation_store import AnnotationStore

_FrameList = Annotated[str | None, tyro.conf.arg(metavar="A,B,C:D", help_behavior_hint="")]
_SECOND_PASS = "_pass_2"
"""End of the name of the folder with the frames that an annotator sees again."""


@dataclass(frozen=True)
class AssignArguments:
    """Arguments of `quadrille assign`."""

    session: SessionArg
    """session folder."""
    every: OptionalWhole = None
    """plan every N-th frame."""
    frames: _FrameList = None
    """plan these frames and ranges, such as 0,40,100:110."""
    diverse: OptionalWhole = None
    """plan N frames with the most diverse stored poses."""
    doubted: bool = False
    """plan the frames whose pose is doubtful or lost."""
    person: OptionalName = None
    """name; by default everybody."""
    to: Names = ()
    """annotators; the frames are dealt out to them in turns. By default anybody."""
    each: bool = False
    """give all frames to each annotator instead."""
    blind: Paths = ()
    """folders to write: for each annotator of --to a copy of the session without poses on planned frames."""
    repeat: OptionalWhole = None
    """write N frames of each blind copy again, into a second folder beside it."""
    annotator: OptionalName = None
    """your name, as the author of the plan; remembered."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[AssignArguments, tyro.conf.arg(name="")]) -> None:
    """Plan which frames are annotated by whom, and write blind copies of the session.

    Planning again adds to the plan. Without a choice of frames the plan is shown. docs/annotation.md describes tasks,
    their states, and blind copies.
    """
    from app.session.annotator import set_annotator
    from tracker.annotation.plan import add_tasks, read_tasks
    from tracker.session.lock import SessionLock
    from tracker.session.store.annotation_store import AnnotationStore

    set_annotator(arguments.annotator)
    arguments = replace(arguments, to=tuple(map(_annotator, arguments.to)))
    _check(arguments)
    at = load_target(arguments.session, arguments.person, several=True)
    _check_folders(arguments)
    with SessionLock(at.session.folder), AnnotationStore(at.session.annotations_path) as store:
        added = add_tasks(store, _wishes(at, arguments))
        tasks = read_tasks(store)
        copies = _write_copies(at.session, store, tasks, arguments)
    if arguments.json:
        print(format_json({"added": added, **record(tasks, []), "copies": copies}))
        return
    print(format_plan(tasks))
    for copy in copies:
        print(f"wrote {copy['folder']}: {copy['tasks']} tasks of {copy['annotator']}, pass {copy['pass']}")


def _annotator(text: str) -> str:
    """Return the name of an annotator in the form that a person joins by.

    Raises:
        TrackerError: it is none.
    """
    from app.participants.participants import joined_name

    name = joined_name(text)
    if not name:
        raise TrackerError(f"expected an annotator as --to, found {text!r}; leave it out for anybody")
    return name


def _check(arguments: AssignArguments) -> None:
    """Refuse options that do not go together.

    Raises:
        TrackerError: some do not.
    """
    for option in ("every", "diverse", "repeat"):
        number = getattr(arguments, option)
        if number is not None and number < 1:
            raise TrackerError(f"expected --{option} as a whole number from 1, found {number}; choose another")
    n_choices = sum(map(bool, (arguments.every, arguments.frames, arguments.diverse, arguments.doubted)))
    if n_choices > 1:
        raise TrackerError(
            f"expected one of --every, --frames, --diverse and --doubted, found {n_choices}; plan with each in turn"
        )
    if len(set(arguments.to)) < len(arguments.to):
        raise TrackerError(f"expected each annotator once, found --to {' '.join(arguments.to)}; leave one of them out")
    if arguments.blind and len(arguments.blind) != len(arguments.to):
        raise TrackerError(
            f"expected a folder of --blind for each annotator of --to, found {len(arguments.blind)} and "
            f"{len(arguments.to)}; name as many"
        )
    if arguments.repeat and not arguments.blind:
        raise TrackerError("expected --blind beside --repeat, found none; frames are repeated in blind copies")


def _check_folders(arguments: AssignArguments) -> None:
    """Refuse folders of copies that are in use, before the plan or any copy is written.

    Raises:
        TrackerError: one is in use, or is named twice.
    """
    from tracker.session.folder import require_free, tidy_path

    again = [_second_pass(folder) for folder in arguments.blind if arguments.repeat]
    folders = [tidy_path(folder) for folder in (*arguments.blind, *again)]
    for k, folder in enumerate(folders):
        require_free(folder)
        if folder in folders[:k]:
            raise TrackerError(f"expected a folder for each copy, found {folder} twice; choose another")


def _second_pass(folder: Path) -> Path:
    return Path(folder).with_name(f"{Path(folder).name}{_SECOND_PASS}")


def _wishes(at: Target, arguments: AssignArguments) -> list[tuple[str, int, str]]:
    """Return person, frame and annotator of each task to plan.

    Raises:
        TrackerError: frames are none of the session, or a person has no such poses.
    """
    from tracker.annotation.frame_choice import FrameChoice, choose_frames, dealt

    session, people = at
    choice = FrameChoice(arguments.every or 0, arguments.frames or "", arguments.diverse or 0, arguments.doubted)
    if not any(choice):
        return []
    return [
        (person.name, *pair)
        for person in (session.people[i] for i in people)
        for pair in dealt(choose_frames(session, person, choice, "--frames"), arguments.to, arguments.each)
    ]


def _write_copies(
    session: "Session", store: "AnnotationStore", tasks: "list[Task]", arguments: AssignArguments
) -> list[dict[str, Any]]:
    """Write the blind copies; returns an entry for each."""
    from tracker.annotation.session_copies import write_blind_copy, write_second_pass

    copies: list[dict[str, Any]] = []
    log = store.read_log() if arguments.blind else None
    for name, folder in zip(arguments.to, arguments.blind, strict=False):
        assert log is not None
        n = write_blind_copy(folder, session, log, tasks, name)
        copies.append({"annotator": name, "folder": str(folder), "tasks": n, "pass": 1})
        if arguments.repeat:
            again = _second_pass(folder)
            n = write_second_pass(again, session, log, tasks, name, arguments.repeat)
            copies.append({"annotator": name, "folder": str(again), "tasks": n, "pass": 2})
    return copies
