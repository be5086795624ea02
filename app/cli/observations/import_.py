"""`quadrille import`: bring key points, joints and masks of other programs into a session."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import (
    NamedPaths,
    Names,
    OptionalClock,
    OptionalName,
    OptionalNumber,
    OptionalPath,
    OptionalWhole,
    SessionArg,
    parse_pairs,
)
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.session.session import Session

Unit = Literal["m", "cm", "mm", "in", "ft"]


@dataclass(frozen=True)
class ImportArguments:
    """Arguments of `quadrille import`."""

    session: SessionArg
    """session folder."""
    name: Annotated[str, tyro.conf.arg(name="as", metavar="NAME")]
    """name of the observations in the session."""
    files: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FOLDER|FILE ...", help_behavior_hint="")
    ]
    """files of one format, or folders of them; docs/log/observations.md lists the formats."""
    person: Names = ()
    """people of whom they are; all people by default. Points in space have one file for each, in this order."""
    joint_map: OptionalPath = None
    """TOML file with the names of the points, or the name of a known skeleton such as BODY_25B; guessed by default.
    docs/observations.md has an example."""
    cameras: NamedPaths = ()
    """files or folder of a camera, where names do not tell."""
    first_frame: OptionalWhole = None
    """frame of the session at which the first picture or row lies; by the numbers of the files by default."""
    offset: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME=N ...", help_behavior_hint="")] = ()
    """frames by which the key points of a camera are late, taken off; NAME=0 keeps them as they are."""
    clock: OptionalClock = None
    """points in space: whether each Frame# is a frame of the session, or rows lie at their Time."""
    axes: Annotated[str, tyro.conf.arg(metavar="X,Y,Z")] = "x,y,z"
    """points in space: the file's axes that are the session's x, y, z, e.g. x,-z,y if the file's y points up."""
    units: Annotated[Unit | None, tyro.conf.arg(metavar="m|cm|mm|in|ft", help_behavior_hint="")] = None
    """points in space: unit of a file that states none."""
    confidence: OptionalNumber = None
    """confidence of all points, 0 to 1, where the files have none."""
    picture_size: OptionalName = None
    """WIDTHxHEIGHT of the pictures that points or masks are of, if not the footage's; 1x1 for normalized points."""
    masks: bool = False
    """take masks where the files hold key points too: segmentations of COCO, and PNG beside other files."""
    values: Annotated[tuple[str, ...], tyro.conf.arg(metavar="PERSON=VALUE ...", help_behavior_hint="")] = ()
    """masks: label of the pixels of a person; without it all labels are anyone."""
    unusual: bool = False
    """store points also where they fit no person of the recording, or fit it better in other names, axes or frames."""
    dry_run: bool = False
    """show what would be imported, and store nothing."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[ImportArguments, tyro.conf.arg(name="")]) -> None:
    """Import key points, joints or masks of another program. docs/log/observations.md describes formats.

    It shows which view, frames and points were found. Files that contradict the session are refused. The cameras use
    imported masks as silhouettes; quadrille relink SESSION --no-masks goes back to their backgrounds.
    """
    from app.session.import_summary import import_summary
    from tracker.geometry.lengths import METRES_BY_WORD
    from tracker.interchange.observations.importing import store_import
    from tracker.interchange.observations.plans import ImportRequest
    from tracker.interchange.plausibility.examine import plan_examined_import
    from tracker.session.lock import SessionLock
    from tracker.session.session import load_session

    if not arguments.files:
        raise TrackerError("expected a folder or files to import after the session, found none; name them")
    session = load_session(arguments.session)
    request = ImportRequest(
        arguments.name, arguments.files, _people(session, arguments.person), arguments.joint_map,
        parse_pairs(arguments.cameras, "--cameras", Path), arguments.first_frame,
        parse_pairs(arguments.offset, "--offset", int), arguments.clock, arguments.axes,
        None if arguments.units is None else METRES_BY_WORD[arguments.units], _confidence(arguments.confidence),
        _size(arguments.picture_size), arguments.masks, arguments.unusual,
        parse_pairs(arguments.values, "--values", int),
    )  # fmt: skip
    plan = plan_examined_import(session, request)
    summary: dict[str, Any] = {**import_summary(session, plan, command_line_text), "stored": False}
    if not (plan.problems or arguments.dry_run):
        with SessionLock(session.folder):
            store_import(load_session(session.folder), plan)  # which may have changed while files were read
        summary["stored"] = True
    print(format_json(summary) if arguments.json else _format(summary))
    if plan.problems:
        raise plan.problems[0]


def _people(session: "Session", names: tuple[str, ...]) -> tuple[str, ...]:
    from tracker.session.matching import check_names

    known = [p.name for p in session.people]
    found = check_names(names, known, "person", "the people of --person") if names else known
    if len(set(found)) < len(found):
        raise TrackerError(f"expected each person of --person once, found {', '.join(names)}")
    return tuple(found)


def _confidence(value: float | None) -> float | None:
    if value is not None and not 0 < value <= 1:
        raise TrackerError(f"expected --confidence above 0 and at most 1, found {value:g}")
    return value


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 0 < int(width) < 100_000 and 0 < int(height) < 100_000):
        raise TrackerError(f"expected --picture-size as WIDTHxHEIGHT, such as 1920x1080, found '{text}'")
    return int(width), int(height)


def _format(summary: dict[str, Any]) -> str:
    lines = [f"{summary['name']}: {summary['format']}, of {', '.join(summary['people']) or 'anyone'}"]
    for v in summary["views"]:
        if v["place"] is None:
            lines.append(f"  {v['view']}: no files")
            continue
        what, rows = ("people", "masks") if summary["are_masks"] else ("points", "rows")
        frames = f"no {what}" if v["frames"] is None else f"{what} in frames {v['frames'][0]} to {v['frames'][1]}"
        share = f", {v['share']:.1%} of the picture" if v["share"] == v["share"] else ""
        people = f", up to {v['most_people']} people" if v["most_people"] > 1 else ""
        confidence = f", median confidence {v['confidence']:.2f}" if v["confidence"] == v["confidence"] else ""
        lines.append(f"  {v['view']}: {v['place']}, {v['rows']} {rows}, {frames}{people}{confidence}{share}")
    if not summary["are_masks"]:
        lines += _point_lines(summary)
    lines += [f"  note: {note}" for note in summary["notes"]]
    lines += [f"  problem: {problem}" for problem in summary["problems"][1:]]
    if summary["stored"]:
        used = "; the cameras use these masks as silhouettes" if summary["are_masks"] else ""
        lines.append(f"stored as {summary['name']}{used}")
    elif not summary["problems"]:
        lines.append("nothing was stored")
    return "\n".join(lines)


def _point_lines(summary: dict[str, Any]) -> list[str]:
    named = {name: " and ".join(points) for name, points in summary["points"].items()}
    matched = ", ".join(f"{name} = {points}" for name, points in named.items() if points)
    others = ", ".join(name for name, points in named.items() if not points)
    lines = [f"  points as {summary['skeleton']} names them: {matched or 'none'}"]
    return lines + ([f"  points without a joint of the body: {others}"] if others else [])
