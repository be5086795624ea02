"""`quadrille calibrate`: calibrate cameras by footage of a board, or of people."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import (
    CommonOrNamed,
    NamedPaths,
    NamedValues,
    Names,
    OptionalPath,
    OptionalWhole,
    Paths,
    finite,
    parse_common_or_pairs,
    parse_pairs,
)
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tracker.compute.progress import Report
    from tracker.geometry.cameras import Camera

    _Calibrated = tuple[Sequence[Camera], dict[str, Any], str]
    """The cameras, and the report as plain data and as text."""


@dataclass(frozen=True)
class CalibrateArguments:
    """Arguments of `quadrille calibrate`."""

    out: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """file to write."""
    board: OptionalPath = None
    """.toml file of the board: Caliscope's charuco.toml, anipose's config.toml, or a few lines as in
    docs/calibration.md."""
    people: OptionalPath = None
    """instead of a board: file or folder of key points of people, or of masks of one person, in a format that
    `quadrille import` reads. People need names in the files, or one of them is alone for a while."""
    silhouettes: bool = False
    """instead of a board: find silhouettes of one person in the videos, of cameras that stand still."""
    height: CommonOrNamed = ()
    """with --people or --silhouettes: height of the person or of all people, metres, or NAME=METRES of those whom the
    files name, which is the scale of the world."""
    joint_map: OptionalPath = None
    """with --people: TOML file with the names of the points, or the name of a known skeleton such as BODY_25B; guessed
    by default."""
    lenses: OptionalPath = None
    """with --people or --silhouettes: a calibration of which the lenses are taken; by default focal lengths are
    estimated."""
    videos: Paths = ()
    """video files or image folders, each named after its camera; frame k of all is of one instant."""
    camera: NamedPaths = ()
    """NAME=PATH: footage of a camera, under any file name."""
    fisheye: Names = ()
    """names of the cameras with fisheye lenses."""
    offset: NamedValues = ()
    """CAM=N: frame k of all is frame k + N of this camera."""
    common_frames: bool = False
    """leave out frames at the end that some cameras lack."""
    every: OptionalWhole = None
    """look at each N-th frame; by default at no more than 600 frames."""
    floor_frame: OptionalWhole = None
    """frame on which the board lies on the floor: it defines the world, with z up. By default the first camera does,
    with y down."""
    layout: Literal["quadrille", "anipose", "pose2sim", "caliscope", "opencv"] = "quadrille"
    """layout of the file; quadrille is that of a session's calibration.toml."""
    any_size: bool = False
    """take squares of a board below 5 or above 300 mm, people below 0.6 or above 2.3 m, and unusual focal lengths."""
    overwrite: bool = False
    """replace a file that exists."""
    json: bool = False
    """print one JSON object; docs/log/calibration.md lists its keys."""


def command(arguments: Annotated[CalibrateArguments, tyro.conf.arg(name="")]) -> None:
    """Calibrate cameras by footage of a board, by key points of people, or by silhouettes of a person.

    The board may be a ChArUco board, also partly visible, or a checkerboard. Ctrl+C stops it and writes nothing.
    """
    from app.session.calibration_record import check_out, write_cameras

    _check(arguments)
    check_out(arguments.out, arguments.overwrite)
    calibrate = _by_board if arguments.board is not None else _by_person
    with Reporter(silent=arguments.json).share("calibrating") as advance:
        cameras, record, text = calibrate(arguments, lambda stage, share, text="", /: advance(share))
    write_cameras(arguments.out, cameras, arguments.layout)
    print(format_json(record) if arguments.json else text)


def _by_board(arguments: CalibrateArguments, report: "Report") -> "_Calibrated":
    from app.session.calibration_record import board_record
    from tracker.calibration.boards.board_description import read_board
    from tracker.calibration.boards.footage_calibration import FilmedBoard, calibrate_footage

    assert arguments.board is not None
    filmed = FilmedBoard(
        read_board(arguments.board, arguments.any_size),
        arguments.videos,
        parse_pairs(arguments.camera, "--camera", Path),
        arguments.fisheye,
        parse_pairs(arguments.offset, "--offset", int),
        arguments.common_frames,
        arguments.every,
        arguments.floor_frame,
    )
    found = calibrate_footage(filmed, report)
    record = {"out": str(arguments.out), "layout": arguments.layout, **board_record(found)}
    return found.cameras, record, _format(record, arguments)


def _by_person(arguments: CalibrateArguments, report: "Report") -> "_Calibrated":
    from app.cli.calibration.person_report import format_record, record_of
    from tracker.calibration.self_calibration.person_files import FilmedPerson, calibrate_filmed_person

    filmed = FilmedPerson(
        arguments.people,
        arguments.videos,
        parse_pairs(arguments.camera, "--camera", Path),
        parse_pairs(arguments.offset, "--offset", int),
        arguments.common_frames,
        parse_common_or_pairs(arguments.height, "--height", finite),
        arguments.lenses,
        arguments.joint_map,
        arguments.any_size,
    )
    found = calibrate_filmed_person(filmed, report)
    record = {"out": str(arguments.out), "layout": arguments.layout, **record_of(found)}
    return found.cameras, record, format_record(record)


def _check(arguments: CalibrateArguments) -> None:
    """Check what can be checked before the footage is read."""
    by = {"--board": arguments.board is not None, "--people": arguments.people is not None}
    given = [option for option, value in {**by, "--silhouettes": arguments.silhouettes}.items() if value]
    if len(given) != 1:
        raise TrackerError(
            f"expected --board FILE, --people KEYPOINTS or --silhouettes, found {' and '.join(given) or 'none'}; "
            "docs/calibration.md shows how to describe a board, and how to calibrate without one"
        )
    of_board = {"--fisheye": arguments.fisheye, "--every": arguments.every, "--floor-frame": arguments.floor_frame}
    of_people = {"--height": arguments.height, "--joint-map": arguments.joint_map, "--lenses": arguments.lenses}
    source, unused = ("--board", of_board) if arguments.board is None else ("--people or --silhouettes", of_people)
    for option, value in unused.items():
        if value not in (None, ()):
            raise TrackerError(f"expected {option} together with {source}, found it without; leave it out")
    if arguments.every is not None and arguments.every < 1:
        raise TrackerError(f"expected --every of at least 1, found {arguments.every}; correct it")


def _format(record: dict[str, Any], arguments: CalibrateArguments) -> str:
    from app.session.calibration_record import error_words

    behind = f", {record['views_from_behind']} of them from behind" if record["views_from_behind"] else ""
    lines = [
        f"wrote {record['out']}: {len(record['cameras'])} cameras from {record['corners']} corners in "
        f"{record['views']} views{behind}"
    ]
    width = max(len(c["name"]) for c in record["cameras"])
    for c in record["cameras"]:
        off = "  no corner held out" if c["held_out_px"] != c["held_out_px"] else f"{c['held_out_px']:6.2f} px held out"
        lines.append(
            f"  {c['name']:{width}}  {c['views']:4} views, focal length {c['focal_px'][0]:7.1f} px "
            f"+- {c['focal_sigma_percent']:.1f}%, noise {c['noise_px']:.2f} px, {off}"
        )
    lines.append(error_words(record))
    lines += [f"note: {note}" for note in record["notes"]]
    if arguments.floor_frame is None:
        first = record["cameras"][0]["name"]
        lines.append(
            f"the world is that of camera '{first}', with y down: say --up -y to quadrille new, or name a frame on "
            "which the board lies on the floor by --floor-frame"
        )
    return "\n".join(lines)
