"""`quadrille new`: make a session from videos and a calibration."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.arguments import (
    CommonOrNamed,
    NamedPaths,
    NamedValues,
    Names,
    OptionalNumber,
    OptionalPath,
    Paths,
    finite,
    parse_common_or_pairs,
    parse_pairs,
)
from tracker.errors import TrackerError
from tracker.formats.calibrations.convention_names import PoseConvention


@dataclass(frozen=True)
class NewArguments:
    """Arguments of `quadrille new`."""

    session: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION", help="folder to make")]
    """folder to make."""
    calibration: Paths = ()
    """file of all cameras, a folder, or a file for each camera, of a layout that docs/log/recordings.md lists; by
    default the one beside a folder of videos."""
    videos: Paths = ()
    """video files or image folders, each named after its camera, or the folder of all; images are paired by their
    numbers. Of a folder of all, calibration, background and masks are taken, too."""
    camera: NamedPaths = ()
    """NAME=PATH: footage of a camera, under any file name."""
    cameras: Names = ()
    """names of the calibrated cameras to use, in this order; all that have footage by default."""
    background: OptionalPath = None
    """folder of CAM.png or CAM.mp4 of the empty scene."""
    masks: OptionalPath = None
    """folder of CAM/%06d.png by video frame; 0 is background."""
    offset: NamedValues = ()
    """CAM=N: frame k of the session is frame k + N of this camera; N may have a fraction, such as 2.4."""
    people: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ("person",)
    """names of the people."""
    model: CommonOrNamed = ()
    """body model of all people, or NAME=MODEL: a preset, or a .toml file such as acquire --out FILE writes."""
    person_model: OptionalPath = None
    """.toml file of the person's body from an earlier session, where there is only one person."""
    height: CommonOrNamed = ()
    """body height of all people, or NAME=HEIGHT, in metres or centimetres: 1.78 or 178."""
    common_frames: bool = False
    """leave out frames that some cameras lack: those at the end, of numbered images at both ends."""
    fps: OptionalNumber = None
    """rate at which the cameras filmed, if the videos declare another one (high-speed), if their time stamps jitter, or
    if all footage is images."""
    up: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """world axis that points up."""
    units: Annotated[Literal["m", "cm", "mm"] | None, tyro.conf.arg(metavar="{m,cm,mm}", help_behavior_hint="")] = None
    """unit of the calibration's translations; by default as the file or its layout states, else metres."""
    poses: Annotated[PoseConvention | None, tyro.conf.arg(metavar="CONVENTION", help_behavior_hint="")] = None
    """convention of the calibration's poses, where the cameras contradict its layout: world-to-camera,
    camera-to-world, row-vectors or camera-position, each also with -opengl at its end."""
    rescale: bool = False
    """scale a calibration at a whole multiple of the footage's size to it: the same field of view in fewer pixels."""
    any_size: bool = False
    """take cameras nearer than 0.5 m or farther than 60 m, people below 0.6 m or above 2.3 m, focal lengths below
    0.3 or above 5 times the longer side of the picture, and cameras of which no two see a person together."""


def command(arguments: Annotated[NewArguments, tyro.conf.arg(name="")]) -> None:
    """Make a session from videos and a calibration."""
    from app.session.camera_check import exchange_note
    from tracker.geometry.lengths import height_m
    from tracker.session.assemble import DEFAULT_MODEL, NewSession, assemble, unfilmed_cameras
    from tracker.session.rig_summary import summarize_rig

    arguments = _with_parts_of_folder(arguments)
    heights = parse_common_or_pairs(arguments.height, "--height", lambda text: height_m(float(text)))
    request = NewSession(
        arguments.session, calibration=arguments.calibration, videos=arguments.videos,
        camera_paths=parse_pairs(arguments.camera, "--camera", Path), cameras=arguments.cameras,
        background=arguments.background, masks=arguments.masks,
        offsets=parse_pairs(arguments.offset, "--offset", finite), people=arguments.people,
        models=_models(arguments) or DEFAULT_MODEL,
        heights=heights, common_frames=arguments.common_frames,
        fps=arguments.fps, up=arguments.up, units=arguments.units, poses=arguments.poses, rescale=arguments.rescale,
        any_size=arguments.any_size,
    )  # fmt: skip
    notes: list[str] = []
    made = assemble(request, note=notes.append)
    print(f"made {made.folder}: {len(made.cameras)} cameras, {made.n_frames} frames at {made.fps:g} per second")
    print(summarize_rig([c.camera for c in made.cameras], made.up).sentence)
    if not request.cameras and (without := unfilmed_cameras(request)):
        used = ", ".join(c.camera.name for c in made.cameras)
        print(f"used: {used}; calibrated cameras without footage are left out: {', '.join(without)}")
    if declared := {f"{c.declared_fps:g}" for c in made.cameras if c.declared_fps is not None}:
        print(f"the videos declare {' or '.join(sorted(declared))} frames per second")
    for note in notes:
        print(f"note: {note}")
    if warning := exchange_note(made):
        print(f"warning: {warning}", file=sys.stderr)


def _with_parts_of_folder(arguments: NewArguments) -> NewArguments:
    """Return arguments with the videos of a folder and the parts that lie beside them.

    Raises:
        TrackerError: no calibration is given, and none lies there.
    """
    from tracker.errors import SessionError
    from tracker.files import paths_in
    from tracker.formats.calibrations.reading import read_cameras
    from tracker.session.footage_files import footage_in, side_parts
    from tracker.session.matching import camera_name

    folder = arguments.videos[0] if len(arguments.videos) == 1 and arguments.videos[0].is_dir() else None
    beside = None if folder is None else side_parts(folder)
    found = None if beside is None else beside.calibration
    calibration = arguments.calibration or ((found,) if found else ())
    if not calibration:
        raise TrackerError("expected a calibration of the cameras, found none; give it with --calibration")
    if folder is None or beside is None:
        return replace(arguments, calibration=calibration)
    filmed = [camera_name(path) for path in (folder, *paths_in(folder, SessionError))]
    cameras = read_cameras(calibration, arguments.units, arguments.poses, filmed, any_size=True)
    if filmed[0] in {c.name for c in cameras.entries}:
        return replace(arguments, calibration=calibration)
    background, masks = arguments.background or beside.background, arguments.masks or beside.masks
    parts = {"calibration": calibration[0], "background": background, "masks": masks}
    print(f"{folder} with " + ", ".join(f"{name} {path}" for name, path in parts.items() if path))
    return replace(
        arguments, videos=tuple(footage_in(folder)), calibration=calibration, background=background, masks=masks
    )


def _models(arguments: NewArguments) -> Mapping[str, str] | str | None:
    """Return the body model of all people or by name; None without an option.

    Raises:
        TrackerError: --person-model with several people, or with another option that gives the same.
    """
    path = arguments.person_model
    if path is None:
        return parse_common_or_pairs(arguments.model, "--model", str)
    if len(arguments.people) != 1:
        people = ", ".join(arguments.people)
        raise TrackerError(
            f"expected one person with --person-model, found {people}; say --model NAME={path} for each known body"
        )
    for option, words in (("--model", arguments.model), ("--height", arguments.height)):
        if words:
            raise TrackerError(f"expected --person-model without {option}, found both; the file has body and height")
    if path.suffix != ".toml" or not path.is_file():
        raise TrackerError(
            f"expected --person-model as a .toml file of a body, found '{path}'; write one with quadrille acquire --out"
        )
    return str(path)
