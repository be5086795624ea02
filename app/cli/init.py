"""`quadrille init`: set a first pose, from known joints, from a table of poses, or from the silhouettes."""

import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import OptionalClock, OptionalName, OptionalPath, OptionalWhole, SessionArg
from app.cli.json_output import format_json
from app.cli.target import Target, load_target
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.formats.pose_csv import PoseTable
    from tracker.formats.trc import MarkerTable
    from tracker.geometry.arrays import Array
    from tracker.session.session import Person, Session


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
    method: Literal["joints", "poses", "voxels", "axis", "auto"] = "joints"
    """joints fits the pose to known joints; poses copies it from a table; voxels finds the parts of the body in the
    visual hull; axis searches the body on the axis of the silhouettes; auto tries both on several frames and keeps the
    start that tracks best."""
    frame: int = 0
    """frame to set; with auto the first one to try."""
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
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[InitArguments, tyro.conf.arg(name="")]) -> None:
    """Set a first pose."""
    from tracker.evaluation.references import placement, read_joints
    from tracker.formats.pose_csv import read_pose_table

    method, frame = arguments.method, arguments.frame
    is_found = method in ("voxels", "axis", "auto")
    at = load_target(arguments.session, arguments.person, several=is_found)
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
        found = init_from_poses(at, frame, read_pose_table(path))
        text = f"{found['person']}, frame {frame}: set from {path}"
    else:
        known = placement(at.session, arguments.first_frame, arguments.clock)
        joints = read_joints(path, at.session.fps, arguments.joint_map, arguments.axes, known)
        found = init_from_joints(at, frame, joints, arguments.fit_sizes)
        residual = f"{found['mean_mm']:.1f} mm from {len(found['residual_mm'])} joints on average"
        text = f"{found['person']}, {found['height_m']:.2f} m tall, frame {frame}: {residual}"
        text += "" if found["sizes"] is None else f"\n{found['sizes']}"
        if found["mean_mm"] > _MISFIT_MM:
            height_m = at.session.people[at.people[0]].model.height_m
            text += (
                f"\nnote: these joints fit no body of {height_m:.2f} m: check the Units of the file and the names of "
            )
            text += "its joints, or say --fit-sizes"
        text += "".join(f"\nnote: {note}" for note in found["notes"])
    lines = [text, *(f"  view {name}: {view['text']}" for name, view in found["views"].items())]
    seeing = [name for name, view in found["views"].items() if view["n_inside"]]
    if len(seeing) == 1 < len(found["views"]):
        lines.append(f"note: only '{seeing[0]}' has the body in its picture: check --axes and the world of the file")
    lines += [] if found["warning"] is None else [f"warning: {found['warning']}"]
    print(format_json(found) if arguments.json else "\n".join(lines))


def _init_from_silhouettes(at: Target, arguments: InitArguments) -> None:
    from app.cli.init_silhouettes import format_first_poses, init_from_silhouettes
    from tracker.tracking.voxel.settings import check_voxel_size

    check_voxel_size(arguments.voxel_size / 1000)
    progress = Reporter(silent=arguments.json or arguments.method != "auto")
    found = init_from_silhouettes(
        at, arguments.method, arguments.frame, arguments.voxel_size / 1000, arguments.person is None, progress
    )
    print(format_json(found) if arguments.json else format_first_poses(found))


def init_from_joints(at: Target, frame: int, joints: "MarkerTable", sizes: bool) -> dict[str, Any]:
    """Fit the pose of one person to known limb joints and store it as a keyframe.

    Args:
        at: the session and the person.
        frame: frame to set.
        joints: positions of joints under the body's names.
        sizes: measure the body's lengths from all frames first. They become a new model revision; no pose changes.

    Returns:
        The residual of each joint, mm, their mean, and the place of the body in each view.

    Raises:
        TrackerError: the joints have no such frame, or the body would be in no picture.
    """
    import numpy as np

    from tracker.acquisition.from_joints import height_from_joints
    from tracker.fitting.gauss_newton import fit_to_points
    from tracker.formats.joint_maps import LIMB_JOINTS
    from tracker.formats.model_toml import has_preset_sizes
    from tracker.session.lock import SessionLock
    from tracker.session.session import save_session

    session, (index,) = at
    person = session.people[index]
    row = np.flatnonzero(joints.frames == frame)
    if not len(row):
        raise TrackerError(_no_row(frame, joints))
    points = dict(zip(joints.names, joints.points[row[0]], strict=True))
    # Conventions disagree about neck and head; the limbs alone determine the trunk too.
    limbs = {n: p for n, p in points.items() if n in LIMB_JOINTS and np.all(np.isfinite(p))}
    note = None
    if sizes or (has_preset_sizes(person.model) and set(joints.names).issuperset(LIMB_JOINTS)):
        height_m = height_from_joints(person.model, joints)
        _check_height(height_m)
        person = replace(person, model=person.model.with_height(height_m))
    with SessionLock(session.folder):
        if sizes:
            person, note = _with_acquired_sizes(session, person, joints)
        fit = fit_to_points(person.model, limbs, centers=True)
        where = _where(session, person, fit.pose, frame)
        if person is not session.people[index]:
            people = tuple(person if i == index else p for i, p in enumerate(session.people))
            save_session(replace(session, people=people))
        known = {n: [float(x) for x in p] for n, p in limbs.items()}
        _store_keyframe(session, person, frame, fit.pose, {"method": "joints", "joints": known})
    fitted = dict(zip(person.model.point_names, person.model.joint_centers_world(fit.pose), strict=True))
    residuals = {n: float(1000 * np.linalg.norm(fitted[n] - p)) for n, p in limbs.items()}
    mean = float(np.mean(list(residuals.values())))
    return {
        "person": person.name, "frame": frame, "height_m": person.model.height_m, "residual_mm": residuals,
        "mean_mm": mean, "sizes": note, "notes": joints.notes, **where,
    }  # fmt: skip


def _no_row(frame: int, joints: "MarkerTable") -> str:
    """Say which frames a file has, and the gap that a frame is in."""
    frames = joints.frames.tolist()
    if frames[0] < frame < frames[-1]:
        before, after = max(f for f in frames if f < frame), min(f for f in frames if f > frame)
        return f"no row for frame {frame}: the file lacks frames {before + 1} to {after - 1}; choose another --frame"
    placed = f" ({joints.notes[0]})" if joints.notes else ""
    return (
        f"expected a row of frame {frame}, found frames {frames[0]} to {frames[-1]} in the file{placed}; "
        "choose another --frame"
    )


def _check_height(height_m: float) -> None:
    from tracker.body.dimensions import HEIGHT_LIMITS_M

    lowest, highest = HEIGHT_LIMITS_M
    if not lowest <= height_m <= highest:
        raise TrackerError(
            f"expected joints of a body {lowest} to {highest} m tall, found one of {height_m:.3g} m; "
            "check the units of the file, and --joint-map"
        )


def _with_acquired_sizes(session: "Session", person: "Person", joints: "MarkerTable") -> tuple["Person", str]:
    """Acquire a person's sizes from known joints and contours; return the person and a sentence on the outcome."""
    from tracker.acquisition.from_contours import AcquisitionSettings, acquire_from_contours
    from tracker.acquisition.from_joints import pose_at_joints
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording

    settings, n = AcquisitionSettings(), session.n_frames
    spread = {round(i * (n - 1) / max(1, settings.candidates - 1)) for i in range(settings.candidates)}
    known = pose_at_joints(person.model, joints, sorted(k for k in spread if k < n))
    if not known.bodies:
        raise TrackerError("fitting sizes needs a frame with at least 4 joints of the limbs, found none")
    with Recording(session.cameras) as recording:
        observer = Observer(session.cameras, recording)
        found = acquire_from_contours(observer, known.bodies, 0, known.placed, settings)
    costs = f"cost {found.cost_before_px:.2f} px before, {found.cost_after_px:.2f} px after"
    if found.cost_after_px >= found.cost_before_px:
        return person, f"sizes not applied: the body would fit the contours worse ({costs})"
    return replace(person, model=found.body), f"sizes from frames {', '.join(map(str, found.frames))}: {costs}"


def init_from_poses(at: Target, frame: int, table: "PoseTable") -> dict[str, Any]:
    """Store one person's pose of a frame from a table of poses, as a keyframe.

    Args:
        at: the session and the person.
        frame: frame in the session and in the table.
        table: poses of a body with the person's degrees of freedom.

    Raises:
        TrackerError: the table has no such frame, or poses of another body, or the body would be in no picture.
    """
    import numpy as np

    from tracker.session.lock import SessionLock

    session, (index,) = at
    person = session.people[index]
    values = table.values_for(person.model)
    if values is None:
        raise TrackerError(
            f"expected poses of '{person.model.name}', the body of '{person.name}', found '{table.model}', which has "
            f"other degrees of freedom ({_differences(table.value_names, person.model.value_names)}); make the session "
            "with the --model, a preset or a file, that the poses are of"
        )
    row = np.flatnonzero(table.frames == frame)
    if not len(row):
        raise TrackerError(f"expected a pose of frame {frame}, found frames {table.frames.tolist()[:8]} in the table")
    where = _where(session, person, values[row[0]], frame)
    with SessionLock(session.folder):
        _store_keyframe(session, person, frame, values[row[0]], {"method": "poses"})
    return {"person": person.name, "frame": frame, **where}


def _where(session: "Session", person: "Person", pose: "Array", frame: int) -> dict[str, Any]:
    """Return the place of a body in the view of each camera, `views`, and a `warning` if two cameras seem exchanged.

    Raises:
        TrackerError: it is in no picture.
    """
    from app.session.camera_check import body_exchange_note
    from tracker.geometry.framing import framings

    points_world = person.model.points_world(pose)
    found = framings([c.camera for c in session.cameras], points_world)
    if not any(f.n_inside for f in found):
        listed = "; ".join(f"'{f.camera}' {f.text}" for f in found)
        raise TrackerError(
            f"expected '{person.name}' in the picture of a camera, found nobody there ({listed}); check --axes, the "
            "units of the file, and that it is in the world of the calibration"
        )
    views = {f.camera: {**f._asdict(), "text": f.text} for f in found}
    return {"views": views, "warning": body_exchange_note(session, frame, points_world)}


def _differences(found: Sequence[str], expected: Sequence[str]) -> str:
    """List the first few names that only one of two lists has."""
    missing, extra = ([n for n in a if n not in b] for a, b in ((expected, found), (found, expected)))
    listed = [f"{what} {', '.join(n[:3])}" for what, n in (("without", missing), ("with", extra)) if n]
    return ", ".join(listed)


def _store_keyframe(
    session: "Session", person: "Person", frame: int, values: "Array", settings: dict[str, Any]
) -> None:
    from tracker.formats.model_toml import format_model
    from tracker.store.annotation_store import AnnotationStore
    from tracker.store.records import PoseChange, PoseRecord

    with closing(AnnotationStore(session.annotations_path)) as store:
        if store.backup_error is not None:
            print(store.backup_error, file=sys.stderr)
        revision = store.add_model_revision(person.name, format_model(person.model))
        sources = ("imported",) * len(values)
        record = PoseRecord(values, sources, revision, keyframe=True, settings=settings)
        store.commit(f"init from {settings['method']}, frame {frame}", [PoseChange(person.name, frame, record)])
