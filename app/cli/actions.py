"""What each command of the command line does; `__main__` reads the words and calls these."""

import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tracker.acquisition.from_joints import fit_sizes
from tracker.errors import SessionError, TrackerError
from tracker.evaluation.metrics import Alignment, evaluate_joints, evaluate_poses
from tracker.evaluation.references import Reference, stored_motion
from tracker.fitting.gauss_newton import fit_to_points
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import format_model
from tracker.formats.pose_csv import PoseTable
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.session.lock import SessionLock
from tracker.session.session import Person, Session, load_session, save_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import FrameRow, PoseChange, PoseRecord


class Target(NamedTuple):
    """Whom a command is about."""

    session: Session
    people: tuple[int, ...]
    """Indices into the session's people."""


def target(folder: Path, person: str | None, several: bool) -> Target:
    """Load a session and find the person a command names.

    Args:
        folder: the session folder.
        person: name; may be left out where there is one person, or where several are meant.
        several: whether no name means everybody.

    Raises:
        SessionError: there is no such person, or a name is needed.
    """
    session = load_session(folder)
    names = [p.name for p in session.people]
    if person is None:
        if several or len(names) == 1:
            return Target(session, tuple(range(len(names))))
        raise SessionError(f"the session has several people: say --person, one of {', '.join(names)}")
    if person not in names:
        raise SessionError(f"expected --person to be one of {', '.join(names)}, found '{person}'")
    return Target(session, (names.index(person),))


def frame_range(text: str | None, session: Session) -> range:
    """Parse `A:B`, half open, either end left out; the whole session for None.

    Raises:
        TrackerError: it is not a range within the session.
    """
    if text is None:
        return range(session.n_frames)
    first, colon, last = text.partition(":")
    try:
        found = range(int(first or 0), int(last or session.n_frames))
    except ValueError:
        found = range(0)
    if not colon or not found or found.start < 0 or found.stop > session.n_frames:
        raise TrackerError(f"expected --frames as A:B within 0:{session.n_frames} (A included, B not), found '{text}'")
    return found


def info(session: Session) -> dict[str, Any]:
    """What a session holds, for people and programs."""
    poses: dict[str, list[FrameRow]] = {p.name: [] for p in session.people}
    if session.annotations_path.exists():
        with closing(AnnotationStore(session.annotations_path, read_only=True)) as store:
            poses = {name: store.frames(name) for name in poses}
    return {
        "name": session.name,
        "folder": str(session.folder),
        "frames": session.n_frames,
        "fps": session.fps,
        "up": session.up,
        "cameras": [
            {
                "name": c.camera.name,
                "size": list(c.camera.size),
                "footage": str(c.footage),
                "background": c.background is not None,
                "masks": c.masks is not None,
                "offset": c.offset,
            }
            for c in session.cameras
        ],
        "people": [
            {
                "name": p.name,
                "model": p.model.name,
                "height_m": p.model.height_m,
                "dofs": p.model.n_dofs,
                "poses": len(poses[p.name]),
                "keyframes": sum(row.keyframe for row in poses[p.name]),
            }
            for p in session.people
        ],
    }


def init_from_joints(at: Target, frame: int, joints: MarkerTable, sizes: bool) -> dict[str, Any]:
    """Fit the pose of one person to known limb joints and store it as a keyframe.

    Args:
        at: the session and the person.
        frame: where.
        joints: places of joints under our names.
        sizes: take the body's lengths from all frames of the joints first; a new model revision, that rewrites no pose.

    Returns:
        The residual of each joint, mm, and their mean.
    """
    session, (index,) = at
    person = session.people[index]
    row = np.flatnonzero(joints.frames == frame)
    if not len(row):
        raise TrackerError(f"expected joints of frame {frame}, found frames 0 to {joints.frames[-1]} in the file")
    places = dict(zip(joints.names, joints.points[row[0]], strict=True))
    # Neck and head mean other places in every convention; the limbs pose the trunk as well.
    limbs = {n: p for n, p in places.items() if n in LIMB_JOINTS and np.all(np.isfinite(p))}
    if sizes:
        person = replace(person, model=fit_sizes(person.model, joints))
    fit = fit_to_points(person.model, limbs)
    with SessionLock(session.folder):
        if sizes:
            people = tuple(person if i == index else p for i, p in enumerate(session.people))
            save_session(replace(session, people=people))
        _store_keyframe(session, person, frame, fit.pose, "joints")
    points = dict(zip(person.model.point_names, person.model.points_world(fit.pose), strict=True))
    residuals = {n: float(1000 * np.linalg.norm(points[n] - p)) for n, p in limbs.items()}
    mean = float(np.mean(list(residuals.values())))
    return {"person": person.name, "frame": frame, "residual_mm": residuals, "mean_mm": mean}


def init_from_poses(at: Target, frame: int, table: PoseTable) -> dict[str, Any]:
    """Store one person's pose of a frame from a table of poses, as a keyframe.

    Args:
        at: the session and the person.
        frame: where, in the session and in the table.
        table: poses of a body with the person's degrees of freedom.

    Raises:
        TrackerError: the table has no such frame, or poses of another body.
    """
    session, (index,) = at
    person = session.people[index]
    values = table.values_for(person.model)
    if values is None:
        raise TrackerError(
            f"expected poses of '{person.model.name}', the body of '{person.name}', found '{table.model}', which has "
            f"other degrees of freedom ({_unlike(table.value_names, person.model.value_names)}); make the session with "
            "the --model, a preset or a file, that the poses are of"
        )
    row = np.flatnonzero(table.frames == frame)
    if not len(row):
        raise TrackerError(f"expected a pose of frame {frame}, found frames {table.frames.tolist()[:8]} in the table")
    with SessionLock(session.folder):
        _store_keyframe(session, person, frame, values[row[0]], "poses")
    return {"person": person.name, "frame": frame}


def _unlike(found: Sequence[str], expected: Sequence[str]) -> str:
    """The first few names that only one of two lists has, for people to read."""
    lacking, more = ([n for n in a if n not in b] for a, b in ((expected, found), (found, expected)))
    said = [f"{what} {', '.join(n[:3])}" for what, n in (("without", lacking), ("with", more)) if n]
    return ", ".join(said)


def _store_keyframe(session: Session, person: Person, frame: int, values: Array, method: str) -> None:
    with closing(AnnotationStore(session.annotations_path)) as store:
        revision = store.add_model_revision(person.name, format_model(person.model))
        sources = ("imported",) * len(values)
        record = PoseRecord(values, sources, revision, keyframe=True, settings={"method": method})
        store.commit(f"init from {method}, frame {frame}", [PoseChange(person.name, frame, record)])


def evaluate(at: Target, reference: Reference, frames: str | None, align: Alignment) -> dict[str, Any]:
    """Compare the stored poses of one person with a reference, over the frames that have poses or the given ones.

    Raises:
        SessionError: there is no pose.
    """
    session, (index,) = at
    person = session.people[index]
    joints, motion = stored_motion(session, index)
    if motion is None or not motion.poses:
        raise SessionError(f"'{person.name}' has no poses yet; place the body in the page, or use init and track")
    poses = motion.poses
    wanted = range(min(poses), max(poses) + 1) if frames is None else frame_range(frames, session)
    result = evaluate_joints(joints, reference.joints, wanted, align)
    if reference.motion is not None:
        result = evaluate_poses(result, motion, reference.motion, wanted)
    return {"person": person.name, **asdict(result)}


def as_json(result: Any) -> str:
    """One JSON object; numbers that JSON cannot hold become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if hasattr(value, "_asdict"):
        value = value._asdict()
    elif hasattr(value, "__dataclass_fields__"):
        value = asdict(value)
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
