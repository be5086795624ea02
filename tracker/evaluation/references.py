"""References for an evaluation: joints of any program, poses of a CSV table, or another session."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import FormatError, SessionError
from tracker.evaluation.metrics import Motion, PoseDoubt, joints_of_poses
from tracker.formats.joint_maps import joints_of, read_joint_map
from tracker.formats.joint_tables.layouts import by_subject
from tracker.formats.model_toml import PRESETS, load_model
from tracker.formats.pose_csv import PoseTable, is_pose_table, read_pose_table
from tracker.formats.trc import MarkerTable, remap_axes
from tracker.geometry.arrays import Array
from tracker.interchange.observations.placing import name_points
from tracker.interchange.observations.readers import FORMATS, SPACE_FORMATS, find_files
from tracker.session.folder import SESSION_FILE
from tracker.session.row_placement import Clock, RowPlacement, place_rows
from tracker.session.session import Session, load_session
from tracker.session.store.records import PoseRecord
from tracker.session.store.stored_poses import read_stored_poses


class Reference(NamedTuple):
    """A motion to compare with, in the session's frames and axes."""

    joints: MarkerTable
    """Joints under the project's names."""
    motion: Motion | None
    """Poses of any body; None if unknown."""
    n_frames: int | None = None
    """Length of the recording that it is of, in the session's frames; None if unknown."""
    assessed: Mapping[int, PoseDoubt] = MappingProxyType({})
    """PoseDoubt of stored poses by frame."""


def read_joints(
    path: Path, fps: float, joint_map: Path | None = None, axes: str = "x,y,z", known: RowPlacement | None = None
) -> MarkerTable:
    """Read the joints of one person under the project's names, in a session's frames and axes, metres.

    Args:
        path: the file, of any layout of joints that `observations.readers` lists.
        fps: frame rate of the session, 1/s.
        joint_map: TOML file with its naming convention; guessed by default.
        axes: which of its axes are the session's x, y, z.
        known: facts of the session and choices of the user that place the rows; see `placement`.

    Raises:
        FormatError: the file or the map is malformed, no convention fits, the file has several people, or rows may lie
            at several frames.
    """
    given = read_joint_map(joint_map) if joint_map is not None else None
    asked = tuple(given.markers.values()) if given else ()
    table, where = read_person(path, fps, asked, "joints")
    placed = place_rows(remap_axes(table, axes), where, fps, known)
    names, mapping = name_points(placed.names, given, str(path))
    return joints_of(replace(placed, names=names), str(path), mapping if names != placed.names else given)


def read_person(path: Path, fps: float | None, asked: Sequence[str], kind: str) -> tuple[MarkerTable, str]:
    """Return the points of the only person in a file, as they stand in it, and how messages name the file.

    Args:
        path: the file, of any layout of points in space that `observations.readers` lists.
        fps: frame rate of the session, 1/s; None if the file must have its own.
        asked: names of points that are looked for, for files that put subjects before names.
        kind: what the points are: "joints" or "markers".

    Raises:
        FormatError: the file is malformed, has no points in space, or has several people.
    """
    layout, files = find_files([path])
    where = f"{FORMATS[layout].program} file {path}"
    if layout not in SPACE_FORMATS:
        raise FormatError(f"expected {kind} in space, found the {where}; import it, or choose another file")
    read = SPACE_FORMATS[layout].read([file for file, _ in files], None, fps)
    tables = [own for _, table in read for own in by_subject(table, asked)]
    if len(tables) != 1:
        raise FormatError(f"{where}: expected the {kind} of one person, found those of {len(tables)}; keep one in it")
    return tables[0], where


def placement(session: Session, first_frame: int | None = None, clock: Clock | None = None) -> RowPlacement:
    """Return the facts of a session that place the rows of a file, with the user's choices; see `RowPlacement`."""
    declared = tuple({c.declared_fps for c in session.cameras if c.declared_fps is not None})
    return RowPlacement(session.n_frames, declared, first_frame, clock)


def read_reference(
    path: Path,
    session: Session,
    person: int,
    joint_map: Path | None = None,
    axes: str = "x,y,z",
    known: RowPlacement | None = None,
) -> Reference:
    """Read a reference of any kind: joints of any program, a pose table (CSV), or a session folder.

    The poses of a table belong to the body model in `NAME_model.toml` beside `NAME.csv`, as `simulate` writes it.
    Without that file they belong to the preset that the table names, at its height. Otherwise the person's own model is
    used, and only the angles are reliable.

    The rows of joints are placed by `known`, by default with the session's facts alone.

    Raises:
        FormatError: the file is malformed or of an unknown kind, the body of its poses is unknown, or rows of joints
            may lie at several frames.
        SessionError: the reference session has no such person.
    """
    model = session.people[person].model
    if path.is_dir() or path.name == SESSION_FILE:
        return _of_session(path if path.is_dir() else path.parent, session, person)
    if not path.exists():
        raise FormatError(f"expected a reference as joints, a pose table or a session folder, found no file '{path}'")
    if is_pose_table(path):
        motion = _of_table(read_pose_table(path), path, model)
        return Reference(joints_of_poses(*motion, session.fps), motion, max(motion.poses) + 1)
    joints = read_joints(path, session.fps, joint_map, axes, known or placement(session))
    begins_later = joints.frames[0] > 0 and joints.frames[-1] < session.n_frames
    return Reference(joints, None, None if begins_later else int(joints.frames[-1]) + 1)


def stored_motion(session: Session, person: int) -> Reference:
    """Return the stored poses of a person, and the joints of each pose in the body that it was made with.

    The dimensions of a body may have changed since: a pose belongs to the model revision that it names.
    """
    name, model = session.people[person].name, session.people[person].model
    by_model: dict[BodyModel, dict[int, Array]] = {}
    assessed: dict[int, PoseDoubt] = {}
    for frame, stored in read_stored_poses(session.annotations_path, name, model).items():
        assessed[frame] = _assessment(stored.record)
        if len(stored.body.values) == len(model.value_names):
            by_model.setdefault(stored.body.model, {})[frame] = stored.body.values
    tables = [joints_of_poses(m, poses, session.fps) for m, poses in by_model.items()]
    poses = {frame: values for some in by_model.values() for frame, values in some.items()}
    joints = _merged(tables) if tables else joints_of_poses(model, {}, session.fps)
    return Reference(joints, Motion(model, poses), assessed=assessed)


def _assessment(record: PoseRecord) -> PoseDoubt:
    from tracker.estimation.tracking.pose_errors import probability_off  # imported lazily: it loads kernels

    off = float(probability_off(np.array(record.limbs_lost)).max()) if record.limbs_lost else None
    return PoseDoubt("keyframe" if record.keyframe else record.status, off, record.remark, record.seam_mm)


def _merged(tables: Sequence[MarkerTable]) -> MarkerTable:
    """Merge the rows of several tables of the same joints, by frame."""
    frames = np.concatenate([t.frames for t in tables])
    order = np.argsort(frames)
    times, points = (np.concatenate([getattr(t, part) for t in tables])[order] for part in ("times", "points"))
    return MarkerTable(tables[0].names, frames[order], times, points, tables[0].rate)


def _of_session(folder: Path, session: Session, person: int) -> Reference:
    other = load_session(folder)
    name = session.people[person].name
    index = next((i for i, p in enumerate(other.people) if p.name == name), 0 if len(other.people) == 1 else None)
    if index is None:
        raise SessionError(f"expected a person '{name}' in {folder}, found {', '.join(p.name for p in other.people)}")
    return stored_motion(other, index)._replace(n_frames=other.n_frames)


def _of_table(table: PoseTable, path: Path, own: BodyModel) -> Motion:
    """Return the poses of a table with their body; `own` is the body of the person to compare."""
    beside = path.with_name(f"{path.stem}_model.toml")
    if beside.is_file():
        model = load_model(beside, table.height_m)
    elif table.model in PRESETS:
        model = load_model(table.model, table.height_m)
    else:
        model = own
    values = table.values_for(model)
    if values is None:
        raise FormatError(
            f"{path} has poses of '{table.model}', whose degrees of freedom are not those of '{model.name}'; "
            f"put its body model beside it as {beside.name}"
        )
    return Motion(model, dict(zip(table.frames.tolist(), values, strict=True)))
