"""Set a first pose that a file gives: known joints, or a table of poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tracker.errors import Remedy, TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings, acquire_from_contours
from tracker.estimation.acquisition.from_joints import height_from_joints, pose_at_joints
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import format_model, has_preset_sizes
from tracker.formats.pose_csv import PoseTable
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.geometry.framing import Framing, framings
from tracker.interchange.plausibility.examine import examine_joints
from tracker.session.lock import SessionLock
from tracker.session.session import Person, Session, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord


@dataclass(frozen=True)
class GivenPose:
    """A first pose from a file, stored as a keyframe."""

    person: Person
    """The person with the present body."""
    pose: Array
    """The pose, (dofs,)."""
    views: tuple[Framing, ...]
    """The place of the body in the view of each camera."""
    residuals_mm: Mapping[str, float] = field(default_factory=dict)
    """Distance of the body from each known joint of a limb, millimetres; empty for a pose from a table."""
    acquired: Acquisition | None = None
    """Sizes that were acquired from the joints and the contours; they are applied where the cost fell."""
    backup_error: str | None = None
    """Why the store could not be backed up; None if it could."""
    notes: tuple[str, ...] = ()
    """Sentences on reasons against the joints, which the user accepted."""

    @property
    def points_world(self) -> Array:
        """Joints of the body, (N, 3), metres."""
        return self.person.model.points_world(self.pose)


def set_pose_at_joints(
    session: Session, index: int, frame: int, joints: MarkerTable, fit_sizes: bool, axes: str = "x,y,z",
    unusual: bool = False,
) -> GivenPose:  # fmt: skip
    """Fit the pose of a person to the known joints of a frame, and store it.

    The limbs alone determine the pose, the trunk included: conventions disagree about neck and head. A body in preset
    sizes takes the height of the joints if the file has all limbs.

    Args:
        session: not open elsewhere.
        index: of the person.
        frame: to set.
        joints: positions of joints under the body's names.
        fit_sizes: acquire the sizes of the body from several frames first. Poses that are stored stay.
        axes: of the file by which the joints were read.
        unusual: whether joints that are implausible for a person of the recording are accepted.

    Raises:
        TrackerError: the file has no such frame, its joints are those of no person, or the body is in no picture.
    """
    person = session.people[index]
    row = np.flatnonzero(joints.frames == frame)
    if not len(row):
        raise TrackerError(_no_row(frame, joints), Remedy("frame_of_file"))
    doubts = examine_joints(session, index, joints, axes, frame)
    if doubts and not unusual:
        raise doubts[0]
    points = dict(zip(joints.names, joints.points[row[0]], strict=True))
    limbs = {n: p for n, p in points.items() if n in LIMB_JOINTS and np.all(np.isfinite(p))}
    is_open = fit_sizes and person.model.height_sigma is None
    if is_open or (has_preset_sizes(person.model) and set(joints.names).issuperset(LIMB_JOINTS)):
        person = replace(person, model=person.model.with_height(height_from_joints(person.model, joints)))
    with SessionLock(session.folder):
        acquired = _acquire(session, person, joints) if fit_sizes else None
        if acquired is not None and acquired.is_better:
            person = replace(person, model=acquired.body)
        pose = fit_to_points(person.model, limbs, centers=True).pose
        views = _views(session, person, pose)
        if person is not session.people[index]:
            people = tuple(person if i == index else p for i, p in enumerate(session.people))
            save_session(replace(session, people=people))
        known = {n: [float(x) for x in p] for n, p in limbs.items()}
        backup_error = _store(session, person, frame, pose, {"method": "joints", "joints": known})
    fitted = dict(zip(person.model.point_names, person.model.joint_centers_world(pose), strict=True))
    residuals_mm = {n: float(1000 * np.linalg.norm(fitted[n] - p)) for n, p in limbs.items()}
    notes = tuple(f"{doubt}; kept, as chosen" for doubt in doubts)
    return GivenPose(person, pose, views, residuals_mm, acquired, backup_error, notes)


def set_pose_from_table(session: Session, index: int, frame: int, table: PoseTable) -> GivenPose:
    """Store the pose that a table has of a frame.

    Args:
        session: not open elsewhere.
        index: of the person.
        frame: in the session and in the table.
        table: poses of a body with the person's degrees of freedom.

    Raises:
        TrackerError: the table has no such frame, or poses of another body, or the body is in no picture.
    """
    person = session.people[index]
    values = table.values_for(person.model)
    if values is None:
        raise TrackerError(
            f"expected poses of '{person.model.name}', the body of '{person.name}', found '{table.model}', which has "
            f"other degrees of freedom ({_differences(table.value_names, person.model.value_names)})",
            Remedy("body_of_table"),
        )
    row = np.flatnonzero(table.frames == frame)
    if not len(row):
        raise TrackerError(f"expected a pose of frame {frame}, found frames {table.frames.tolist()[:8]} in the table")
    pose = values[row[0]]
    views = _views(session, person, pose)
    with SessionLock(session.folder):
        backup_error = _store(session, person, frame, pose, {"method": "poses"})
    return GivenPose(person, pose, views, backup_error=backup_error)


def _no_row(frame: int, joints: MarkerTable) -> str:
    """Say which frames a file has, and the gap that a frame is in."""
    frames = joints.frames.tolist()
    if frames[0] < frame < frames[-1]:
        before, after = max(f for f in frames if f < frame), min(f for f in frames if f > frame)
        return f"no row for frame {frame}: the file lacks frames {before + 1} to {after - 1}"
    placed = f" ({joints.notes[0]})" if joints.notes else ""
    return f"expected a row of frame {frame}, found frames {frames[0]} to {frames[-1]} in the file{placed}"


def _acquire(session: Session, person: Person, joints: MarkerTable) -> Acquisition:
    """Acquire a person's sizes from known joints and contours of frames spread over the session."""
    settings, n = AcquisitionSettings(), session.n_frames
    spread = {round(i * (n - 1) / max(1, settings.candidates - 1)) for i in range(settings.candidates)}
    known = pose_at_joints(person.model, joints, sorted(k for k in spread if k < n))
    if not known.bodies:
        raise TrackerError("fitting sizes needs a frame with at least 4 joints of the limbs, found none")
    with open_observer(session.cameras) as observer:
        return acquire_from_contours(observer, known.bodies, 0, known.placed, settings)


def _views(session: Session, person: Person, pose: Array) -> tuple[Framing, ...]:
    """Return the place of a body in each view.

    Raises:
        TrackerError: it is in no picture.
    """
    framing = framings([c.camera for c in session.cameras], person.model.points_world(pose))
    if not any(f.n_inside for f in framing):
        listed = "; ".join(f"'{f.camera}' {f.text}" for f in framing)
        raise TrackerError(
            f"expected '{person.name}' in the picture of a camera, found nobody there ({listed})",
            Remedy("check_world_of_file"),
        )
    return framing


def _differences(found: Sequence[str], expected: Sequence[str]) -> str:
    """List the first few names that only one of two lists has."""
    missing, extra = ([n for n in a if n not in b] for a, b in ((expected, found), (found, expected)))
    listed = [f"{what} {', '.join(n[:3])}" for what, n in (("without", missing), ("with", extra)) if n]
    return ", ".join(listed)


def _store(session: Session, person: Person, frame: int, pose: Array, settings: dict[str, object]) -> str | None:
    """Store a keyframe; return why the store could not be backed up."""
    with AnnotationStore(session.annotations_path) as store:
        revision = store.add_model_revision(person.name, format_model(person.model))
        record = PoseRecord(pose, ("imported",) * len(pose), revision, keyframe=True, settings=settings)
        store.commit(f"init from {settings['method']}, frame {frame}", [PoseChange(person.name, frame, record)])
        return store.backup_error
