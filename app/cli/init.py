"""`quadrille init`: set a first pose, from known joints, from a table of poses, or from the silhouettes."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import OptionalClock, OptionalName, OptionalPath, OptionalRange, OptionalWhole, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.estimation.initialization.first_pose import FirstPoses
    from tracker.pipeline.find_people import FindSettings
    from tracker.pipeline.given_pose import GivenPose
    from tracker.session.session import Session


_MISFIT_MM = 100.0
"""Mean distance of the body from the joints above which they are not those of a person of its height."""


@dataclass(frozen=True)
class InitArguments:
    """Arguments of `quadrille init`."""

    session: SessionArg
    """session folder."""
    joints: OptionalPath = None
    """TRC file of 3-D joints."""
    poses: OptionalPath = None
    """table of poses (CSV), as `simulate` writes it."""
    method: Literal["joints", "poses", "voxels", "axis", "auto", "keypoints"] = "joints"
    """joints fits the pose to known joints; poses copies it from a table; voxels finds the parts of the body in the
    visual hull; axis searches the body on the axis of the silhouettes; auto takes stored key points, or tries both on
    the frames whose silhouettes agree best and keeps the start that tracks best; keypoints takes the frame on which the
    key points of --of fit a body best."""
    of: OptionalName = None
    """keypoints: name of the imported observations."""
    frame: int = 0
    """frame to set; with auto one of those that it chooses from."""
    frames: OptionalRange = None
    """A:B, half open: auto and keypoints take one of these; all by default."""
    voxel_size: float = 25.0
    """edge of a voxel, mm."""
    person: OptionalName = None
    """name; needed with joints and poses in a session of several people. The others find everybody who has no pose."""
    fit_sizes: bool = False
    """acquire the body's sizes too, from the joints and the contours of several frames."""
    joint_map: OptionalPath = None
    """TOML file with a line such as left_shoulder = "LSHO" for each joint, if the file has other names."""
    axes: str = "x,y,z"
    """the file's axes in the session's order, such as x,-z,y."""
    first_frame: OptionalWhole = None
    """frame of the session, from 0, at which the first row of the TRC file lies; by default what the file says."""
    clock: OptionalClock = None
    """frames: each Frame# of the TRC file is a frame of the session; time: rows lie at their Time. By default DataRate
    and Time tell, and a contradiction is an error."""
    unusual: bool = False
    """set the pose also where the joints fit no person of the recording, or fit it better in other axes or frames."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[InitArguments, tyro.conf.arg(name="")]) -> None:
    """Set a first pose."""
    method, frame = arguments.method, arguments.frame
    is_found = method in ("voxels", "axis", "auto", "keypoints")
    if (method == "keypoints") != (arguments.of is not None):
        raise TrackerError("expected --method keypoints together with --of NAME, found one of them; give both")
    at = load_target(arguments.session, arguments.person, several=is_found)
    if arguments.frames is not None and method not in ("auto", "keypoints"):
        raise TrackerError(f"expected --frames with --method auto or keypoints, found {method}; say --frame instead")
    if not 0 <= frame < at.session.n_frames:
        n = at.session.n_frames
        raise TrackerError(f"expected --frame within 0:{n} (from 0 to {n - 1}), found {frame}; correct it")
    if is_found:
        _init_from_silhouettes(at, arguments)
        return
    path = arguments.joints if method == "joints" else arguments.poses
    if path is None:
        raise TrackerError(f"expected --{method} FILE, found none; say where the {method} are")
    if method == "poses":
        _init_from_table(at, arguments, path)
    else:
        _init_from_joints(at, arguments, path)


def _init_from_table(at: Target, arguments: InitArguments, path: Path) -> None:
    from tracker.formats.pose_csv import read_pose_table
    from tracker.pipeline.given_pose import set_pose_from_table

    session, (index,) = at
    given = set_pose_from_table(session, index, arguments.frame, read_pose_table(path))
    found = _record(session, arguments.frame, given)
    _print(arguments, given, found, [f"{found['person']}, frame {arguments.frame}: set from {path}"])


def _init_from_joints(at: Target, arguments: InitArguments, path: Path) -> None:
    from tracker.evaluation.references import placement, read_joints
    from tracker.pipeline.body_acquisition import acquisition_sentence
    from tracker.pipeline.given_pose import set_pose_at_joints

    session, (index,) = at
    known = placement(session, arguments.first_frame, arguments.clock)
    joints = read_joints(path, session.fps, arguments.joint_map, arguments.axes, known)
    given = set_pose_at_joints(
        session, index, arguments.frame, joints, arguments.fit_sizes, arguments.axes, arguments.unusual
    )
    notes = [*joints.notes, *given.notes]
    residuals_mm = dict(given.residuals_mm)
    mean_mm, height_m = fmean(residuals_mm.values()), given.person.model.height_m
    sizes = None if given.acquired is None else acquisition_sentence(given.acquired)
    found = _record(session, arguments.frame, given) | {
        "height_m": height_m, "residual_mm": residuals_mm, "mean_mm": mean_mm, "sizes": sizes,
        "notes": notes,
    }  # fmt: skip
    residual = f"{mean_mm:.1f} mm from {len(residuals_mm)} joints on average"
    lines = [f"{given.person.name}, {height_m:.2f} m tall, frame {arguments.frame}: {residual}"]
    lines += [] if sizes is None else [sizes]
    if mean_mm > _MISFIT_MM:
        before_m = session.people[index].model.height_m
        lines.append(
            f"note: these joints fit no body of {before_m:.2f} m: check the Units of the file and the names of its "
            "joints, or say --fit-sizes"
        )
    _print(arguments, given, found, [*lines, *(f"note: {note}" for note in notes)])


def _record(session: "Session", frame: int, given: "GivenPose") -> dict[str, Any]:
    """Return the record of a given pose, with a warning if two cameras seem to be exchanged."""
    from app.session.camera_check import body_exchange_note

    views = {f.camera: {**f._asdict(), "text": f.text} for f in given.views}
    warning = body_exchange_note(session, frame, given.points_world)
    return {"person": given.person.name, "frame": frame, "views": views, "warning": warning}


def _print(arguments: InitArguments, given: "GivenPose", found: dict[str, Any], lines: Sequence[str]) -> None:
    """Print the record, or lines with the place of the body in each view."""
    if given.backup_error is not None:
        print(given.backup_error, file=sys.stderr)
    lines = [*lines, *(f"  view {f.camera}: {f.text}" for f in given.views)]
    seeing = [f.camera for f in given.views if f.n_inside]
    if len(seeing) == 1 < len(given.views):
        lines.append(f"note: only '{seeing[0]}' has the body in its picture: check --axes and the world of the file")
    lines += [] if found["warning"] is None else [f"warning: {found['warning']}"]
    print(format_json(found) if arguments.json else "\n".join(lines))


def _init_from_silhouettes(at: Target, arguments: InitArguments) -> None:
    from tracker.estimation.voxel.settings import check_voxel_size
    from tracker.pipeline.find_people import FindSettings

    check_voxel_size(arguments.voxel_size / 1000)
    progress = Reporter(silent=arguments.json or arguments.method != "auto")
    generator = None if arguments.method in ("auto", "keypoints") else arguments.method
    frames = parse_frames(arguments.frames, at.session)
    first = arguments.frame if arguments.frame in frames else frames.start
    settings = FindSettings(first, generator, arguments.voxel_size / 1000, arguments.of)
    found = init_from_footage(at, arguments.method, settings, frames, arguments.person is None, progress)
    print(format_json(found) if arguments.json else format_first_poses(found))


def init_from_footage(
    at: Target, method: str, settings: "FindSettings", frames: range, only_unplaced: bool, progress: Reporter
) -> dict[str, Any]:
    """Find the poses of people on one frame, and store them as one entry of the history.

    Args:
        at: the session and the people.
        method: its name in the history.
        settings: of the search.
        frames: that may be used.
        only_unplaced: whether people who have a pose keep it.
        progress: says what was tried.

    Returns:
        `frame` and `people`, a list of `person`, `method`, `height_m`, `status`, `cost_px`, `facing_sure`,
        `notes`.

    Raises:
        TrackerError: everybody has a pose, or no frame shows the people well enough; nothing is stored then.
    """
    from tracker.pipeline.automatic_run import open_stored_session, unplaced
    from tracker.pipeline.find_people import find_people

    def report(stage: str, share: float, text: str = "", /) -> None:
        if text:
            progress.say(text)

    session = at.session
    with open_stored_session(session) as opened:
        people = unplaced(opened, at.people) if only_unplaced else at.people
        if not people:
            raise TrackerError(
                "expected a person without a pose, found none; name one with --person to find the person again"
            )
        first = find_people(session, opened.observer, people, frames, settings, report)
        opened.store_found(first, f"init from {method}")
    return first_poses_record(session, first)


def first_poses_record(session: "Session", first: "FirstPoses") -> dict[str, Any]:
    """Return what `init_from_footage` returns."""
    people = [
        {
            "person": session.people[i].name,
            "method": p.start.source,
            "height_m": p.model.height_m,
            "status": p.status,
            "cost_px": None if math.isnan(p.cost_px) else p.cost_px,
            "facing_sure": p.is_facing_sure,
            "notes": list(p.notes),
        }
        for i, p in first.poses.items()
    ]
    return {"frame": first.frame, "people": people}


def format_first_poses(found: dict[str, Any]) -> str:
    """Format the result for a terminal."""
    lines = []
    for own in found["people"]:
        head = f"{own['person']}, {own['height_m']:.2f} m tall, frame {found['frame']}, by {own['method']}"
        cost = "" if own["cost_px"] is None else f": {own['status']}, cost {own['cost_px']:.2f} px"
        lines.append(head + cost)
        lines += [f"note: {note}" for note in own["notes"]]
    return "\n".join(lines)
