"""`quadrille export`: write stored poses to files of other programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import Names, OptionalName
from app.cli.target import Target, load_target
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError
from tracker.interchange.exports.formats import FORMATS, OPTIONS, ExportFormat, find_format

if TYPE_CHECKING:
    from tracker.interchange.exports.datasets.card import RecordingSummary
    from tracker.interchange.exports.motion import Checked, ExportedMotion

_FORMATS_HELP = "; ".join(f"{f.name}: {f.title}" for f in FORMATS.own.values())


def _choice(words: str) -> Any:
    return tyro.conf.arg(metavar=words, help_behavior_hint="")


@dataclass(frozen=True)
class ExportArguments:
    """Arguments of `quadrille export`."""

    sessions: Annotated[
        tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="SESSION ...", help_behavior_hint="")
    ]
    """session folder; dataset: several, with a recording of each."""
    out: Path
    """file or folder to write, or a folder that exists, for one named after the session."""
    format: Annotated[OptionalName, tyro.conf.arg(help=f"{_FORMATS_HELP}. By default as --out ends.")] = None
    person: OptionalName = None
    """name; all people by default. In trc, mot, bvh and c3d each of several people has a file: OUT_NAME.trc."""
    frames: Annotated[str | None, _choice("A:B|A,B,...")] = None
    """A:B, half open, or a list such as 3,7,12; from the first to the last pose by default."""
    keyframes_only: bool = False
    """export poses that a person set or verified, and no others."""
    reviewed_only: bool = False
    """export poses that a person has checked, and no others; keyframes are."""
    axes: Annotated[Literal["calibration", "y-up"] | None, _choice("calibration|y-up")] = None
    """calibration, the session's world; y-up, with the floor at y = 0, default of mot and bvh. glb is always y-up."""
    units: Annotated[Literal["m", "mm"] | None, _choice("m|mm")] = None
    """trc, csv, bvh, c3d: unit of lengths; m by default, mm in c3d."""
    view: OptionalName = None
    """mp4: name of the camera; a grid of all views by default."""
    character: Annotated[str | None, tyro.conf.arg(metavar="BODY[:METRES]")] = None
    """mp4: body that moves as the person, beside the footage: a preset or a .toml file, and its height."""
    pictures: Annotated[Literal["images", "video"] | None, _choice("images|video")] = None
    """dataset: an image of each exported frame, by default, or the footage as it is."""
    keypoints: Annotated[Literal["all", "coco17", "body"] | None, _choice("all|coco17|body")] = None
    """coco, dataset: the 17 keypoints of people, all points of the body, or both, which is the default."""
    pixels: Annotated[Literal["original", "undistorted"] | None, _choice("original|undistorted")] = None
    """openpose, masks, dataset: of the footage (default), or without distortion, with such pictures and cameras."""
    mesh: Annotated[Literal["ply", "obj", "stl", "glb"] | None, _choice("ply|obj|stl|glb")] = None
    """meshes, hulls: format of the files, by default ply; glb is y-up, in metres."""
    blur_faces: bool = False
    """mp4, gif, webp, dataset, scene, undistorted pictures: blur the heads of all people who are known."""
    split: Names = ()
    """dataset: shares of train, validation and test, such as 70:15:15; NAME=test for a recording; by default train."""
    distinct_people: bool = False
    """dataset: people of one name in several recordings are different people; by default they are one."""
    like: OptionalName = None
    """send imported observations back in their own files; --out is a file, or the folder of several."""
    poses: Annotated[Literal["edited", "all"] | None, _choice("edited|all")] = None
    """with --like: replace the points that were edited by hand, which is the default, or those of all poses."""
    plain_joints: bool = False
    """with --like: place points at the joints of the body, not as far from them as the files usually do."""
    exchange_sides: bool = False
    """with --like: exchange left and right of key points where they were found exchanged; by default they stay."""
    skip_lost: bool = False
    """treat poses whose status is lost as missing."""
    provenance: bool = True
    """write OUT.provenance.json beside a format that cannot hold it: who made each pose, how, and how sure it is."""
    overwrite: bool = False
    """replace files that exist."""
    json: bool = False
    """print one JSON object."""

    @property
    def faces(self) -> str | None:
        """The option of an export."""
        return "blurred" if self.blur_faces else None


def added_help() -> str:
    """Return a sentence for help about the formats of extensions; empty without any."""
    listed = "; ".join(f"{name}: {each.title}" for name, each in FORMATS.added.items())
    return listed and f"Formats of extensions: {listed}."


def command(arguments: Annotated[ExportArguments, tyro.conf.arg(name="")]) -> None:
    """Write stored poses to a file of another program. docs/export.md describes each format.

    Ctrl+C stops it and leaves no file behind.
    """
    if not arguments.sessions:
        raise TrackerError("expected the folder of a session, found none; name it after the command")
    if arguments.like is not None:
        return _send_back(arguments)
    _refuse_without_like(arguments)
    if len(arguments.sessions) > 1 or arguments.split or arguments.distinct_people:
        return _export_dataset(arguments)
    from tracker.interchange.exports.export_files import check_options, export, for_format, n_ticks
    from tracker.interchange.exports.motion import read_motion
    from tracker.session.frame_list import parse_frame_list

    at = load_target(arguments.sessions[0], arguments.person, several=True)
    chosen = find_format(arguments.format, arguments.out)
    _check_faces(arguments, chosen)
    out = _file(arguments.out, chosen, at.session.folder.name)
    given = {name: getattr(arguments, name) for name in OPTIONS}
    options = replace(check_options(chosen, at.session, given), provenance=arguments.provenance)
    n_frames, text = at.session.n_frames, arguments.frames
    frames = None if text is None else parse_frame_list(text, n_frames, "--frames")
    motion = for_format(chosen, read_motion(at.session, at.people, frames, arguments.skip_lost, _only(arguments)))
    with Reporter(silent=arguments.json).over(n_ticks(chosen, motion), "exporting") as tick:
        paths = export(chosen, motion, options, out, arguments.overwrite, tick)
    found = _summary(motion, chosen, paths, arguments.skip_lost) | {
        "axes": options.axes if "axes" in chosen.options else None
    }
    print(format_json(found) if arguments.json else _format(found))


def _check_faces(arguments: ExportArguments, chosen: ExportFormat) -> None:
    """Refuse to blur where no picture is written."""
    has_pictures = "faces" in chosen.options and (
        chosen.name not in ("openpose", "masks") or arguments.pixels == "undistorted"
    )
    if arguments.blur_faces and not has_pictures:
        raise TrackerError(
            f"expected --blur-faces with pictures, found format {chosen.name}, which writes none; leave it out, or say "
            "--pixels undistorted where a format has them"
        )


def _only(arguments: ExportArguments) -> "Checked | None":
    return "keyframes" if arguments.keyframes_only else "reviewed" if arguments.reviewed_only else None


def _export_dataset(arguments: ExportArguments) -> None:
    """Write a dataset of several sessions, or of one with a split."""
    from tracker.interchange.exports.datasets.dataset import DatasetRecording, export_dataset, plan_dataset
    from tracker.interchange.exports.datasets.splits import parse_splits, recording_names
    from tracker.interchange.exports.export_files import check_options
    from tracker.interchange.exports.motion import read_motion
    from tracker.session.frame_list import parse_frame_list

    sessions = arguments.sessions
    chosen = find_format(arguments.format, arguments.out)
    if chosen.name != "dataset":
        raise TrackerError(
            f"expected one session for format {chosen.name}, without --split and --distinct-people, found "
            f"{len(sessions)}; say --format dataset, or export one after the other"
        )
    if arguments.frames is not None and len(sessions) > 1:
        raise TrackerError(f"expected --frames with one session, found {len(sessions)}: their frames differ")
    choice, names = parse_splits(arguments.split, "--split"), recording_names(sessions)
    targets = [load_target(folder, arguments.person, several=True) for folder in sessions]
    options = check_options(chosen, targets[0].session, {name: getattr(arguments, name) for name in OPTIONS})

    def read(at: Target) -> "ExportedMotion":
        frames = parse_frame_list(arguments.frames, at.session.n_frames, "--frames") if arguments.frames else None
        return read_motion(at.session, at.people, frames, arguments.skip_lost, _only(arguments))

    recordings = [DatasetRecording(name, partial(read, at)) for name, at in zip(names, targets, strict=True)]
    out = _file(arguments.out, chosen, "recordings" if len(sessions) > 1 else names[0])
    plan = plan_dataset(recordings, options, choice, arguments.distinct_people)
    with Reporter(silent=arguments.json).over(plan.labels.n_frames, "exporting") as tick:
        summaries = export_dataset(plan, options, out, arguments.overwrite, tick)
    found = _dataset_summary(out, sessions, summaries, plan.splits)
    print(format_json(found) if arguments.json else _format_dataset(found))


def _dataset_summary(
    out: Path, sessions: Sequence[Path], summaries: "Sequence[RecordingSummary]", splits: Mapping[str, Sequence[str]]
) -> dict[str, Any]:
    from tracker.interchange.exports.datasets.card import shared_people

    split_of = {name: split for split, names in splits.items() for name in names}
    return {
        "format": "dataset",
        "files": [str(out)],
        "recordings": [
            {
                "name": s.name, "session": str(folder), "split": split_of[s.name], "people": list(s.people),
                "n_frames": s.n_frames, "pictures": s.labels.images, "annotations": s.labels.annotations,
                "poses": s.n_poses, "missing": s.n_missing,
            }
            for folder, s in zip(sessions, summaries, strict=True)
        ],
        "splits": splits,
        "shared_people": [
            {"name": name, "recordings": found, "splits": list(dict.fromkeys(split_of[r] for r in found))}
            for name, found in shared_people(summaries)
        ],
    }  # fmt: skip


def _format_dataset(found: dict[str, Any]) -> str:
    lines = [f"wrote {path}" for path in found["files"]]
    for one in found["recordings"]:
        missing = f", {_count(one['missing'], 'pose')} missing" if one["missing"] else ""
        people = ", ".join(one["people"])
        lines.append(f"{one['split']}: {one['name']}, {people}, {_count(one['n_frames'], 'frame')}{missing}")
    if len(found["recordings"]) > 1 and not (found["splits"]["validation"] or found["splits"]["test"]):
        lines.append("all recordings are in train; --split 70:15:15 or --split NAME=test divides them")
    for person in found["shared_people"]:
        where = f"{person['name']} is in {' and '.join(person['recordings'])}"
        lines.append(f"{where}, taken as one person; --distinct-people takes them as several")
        if len(person["splits"]) > 1:
            lines.append(
                f"{person['name']} is in {' and '.join(person['splits'])}; --split NAME=SPLIT moves a recording"
            )
    return "\n".join(lines)


def _refuse_without_like(arguments: ExportArguments) -> None:
    if arguments.poses is not None or arguments.plain_joints or arguments.exchange_sides:
        raise TrackerError(
            "expected --poses, --plain-joints and --exchange-sides with --like NAME, found no --like; add it"
        )


def _send_back(arguments: ExportArguments) -> None:
    """Write the files of observations, with the points of mended poses replaced."""
    from tracker.interchange.exports.like.patched_files import export_patched
    from tracker.interchange.observations.stored import load_observations
    from tracker.session.session import load_session

    own = {"sessions", "out", "like", "poses", "plain_joints", "exchange_sides", "provenance", "json"}
    others = [f.name for f in fields(arguments) if f.name not in own]
    if given := [name.replace("_", "-") for name in others if getattr(arguments, name) not in (None, False, ())]:
        raise TrackerError(f"expected --like without --{given[0]}: the files stay as they came; leave it out")
    if len(arguments.sessions) > 1:
        raise TrackerError(f"expected one session with --like, found {len(arguments.sessions)}; send each back alone")
    session = load_session(arguments.sessions[0])
    observations = load_observations(session, arguments.like or "")
    done = export_patched(
        session, observations, arguments.out, arguments.poses or "edited", not arguments.plain_joints,
        arguments.exchange_sides,
    )  # fmt: skip
    found = {
        "like": observations.name,
        "format": observations.format,
        "out": str(arguments.out),
        "files": len(done.paths),
        "changed": [str(path) for path in done.changed],
        "frames": list(done.frames),
        "exchanged": [{"frame": frame, "person": person, "view": view} for frame, person, view in done.exchanged],
        "farthest_mm": 1000 * done.farthest_m,
    }
    if arguments.json:
        print(format_json(found))
        return
    print(f"wrote {arguments.out} like {observations.name}, {_count(len(done.paths), 'file')}")
    if not done.changed:
        print("all as imported")
        return
    frames, files = _count(len(done.frames), "frame"), _count(len(done.changed), "file")
    said = [f"points of {frames} were replaced"] if done.frames else []
    if done.exchanged:
        of_sides = _count(len({frame for frame, _, _ in done.exchanged}), "frame")
        said.append(f"left and right were exchanged in {_count(len(done.exchanged), 'view')} of {of_sides}")
    print(f"{', '.join(said)}, in {files}; all else is as imported")
    if farthest_mm := round(1000 * done.farthest_m, 1):
        print(f"points are up to {farthest_mm} mm from their places: the file has constant lengths")


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}{'s' * (n != 1)}"


def _file(out: Path, chosen: ExportFormat, name: str) -> Path:
    """Return the file or folder to write.

    Raises:
        TrackerError: its suffix is of another format, or its folder is missing.
    """
    from tracker.interchange.exports.export_files import is_export_folder

    if out.is_dir() and not (chosen.is_folder and is_export_folder(out)):
        out = out / f"{name}{chosen.suffixes[0]}"
    if out.suffix.lower() != chosen.suffixes[0] and not chosen.is_folder:
        raise TrackerError(
            f"expected --out to end in {chosen.suffixes[0]} for format {chosen.name}, found '{out.name}'; "
            f"rename it to {out.name.removesuffix(out.suffix)}{chosen.suffixes[0]}"
        )
    if not out.parent.is_dir():
        raise TrackerError(f"expected --out in a folder that exists, found none at {out.parent}; make it first")
    return out


def _summary(motion: "ExportedMotion", chosen: ExportFormat, paths: list[Path], skip_lost: bool) -> dict[str, Any]:
    from tracker.interchange.exports.provenance import SIDE_FILE

    return {
        "format": chosen.name,
        "files": [str(path) for path in paths if not path.name.endswith(SIDE_FILE)],
        "provenance": [str(path) for path in paths if path.name.endswith(SIDE_FILE)],
        "people": [p.person.name for p in motion.exported],
        "frames": [motion.span.start, motion.span.stop],
        "n_frames": len(motion.frames),
        "missing": motion.n_missing,
        "lost": motion.n_lost,
        "lost_skipped": skip_lost,
        "calibration": motion.calibrations.present,
        "earlier_calibration": motion.n_earlier,
        "refitted": sum(p.n_refitted for p in motion.exported) if chosen.one_body else 0,
    }


def _format(found: dict[str, Any]) -> str:
    first, last = found["frames"]
    axes = "" if found["axes"] is None else f", axes {found['axes']}"
    lines = [f"wrote {path}" for path in (*found["files"], *found["provenance"])]
    listed = "" if found["n_frames"] == last - first else f" ({found['n_frames']} of them)"
    lines.append(f"{', '.join(found['people'])}, frames {first}:{last}{listed}{axes}")
    if numbering := FORMATS[found["format"]].numbering:
        lines.append(numbering.format(frame=first, number=first + 1))
    if found["missing"]:
        lines.append(f"{found['missing']} poses are missing and {FORMATS[found['format']].gaps}")
    if found["lost"]:
        advice = "treated as missing" if found["lost_skipped"] else "written as they are; --skip-lost leaves them out"
        lines.append(f"{found['lost']} poses are lost, {advice}")
    if found["earlier_calibration"]:
        lines.append(
            f"{found['earlier_calibration']} poses were made before the cameras were corrected (calibration revision "
            f"{found['calibration']}); track them again"
        )
    if found["refitted"]:
        lines.append(f"{found['refitted']} poses of earlier body sizes were refitted to the present body")
    return "\n".join(lines)
