"""Read the poses that several annotators gave the same people in the same frames.

The consensus of annotators: the mean of their poses, and of their joints.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_steps import nearest_equivalent, shortest_step
from tracker.errors import SessionError
from tracker.formats.joint_maps import FOOT_POINTS, JOINTS
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import TINY, Array
from tracker.session.session import Session
from tracker.session.store.stored_poses import StoredPose, read_stored_poses

Poses = Literal["keyframes", "all"]
"""Poses that a person set or verified, or all."""


class Subject(NamedTuple):
    """A person in a frame that every annotator gave a pose."""

    person: str
    frame: int


@dataclass(frozen=True, eq=False)
class Copies:
    """Poses of the same subjects by several annotators."""

    names: tuple[str, ...]
    """Of the annotators: those of their session folders."""
    subjects: tuple[Subject, ...]
    joints: tuple[str, ...]
    points: Array
    """Joint centres, (n_subjects, n_annotators, n_joints, 3), world, metres; NaN where a body lacks the joint."""
    angles: tuple[str, ...]
    """Names of degrees of freedom that are angles."""
    angle_means: Array
    """Consensus of each angle, (n_subjects, n_angles), rad; NaN for ball joints, which have none."""
    angle_steps: Array
    """Steps from the consensus to each annotator, (n_subjects, n_annotators, n_angles), rad; NaN where the bodies of a
    person have different degrees of freedom."""
    fps: float
    """Frames per second."""
    notes: tuple[str, ...] = ()
    """Differences of the copies that a reader of the figures needs to know, as sentences."""


def read_copies(sessions: Sequence[Session], poses: Poses = "keyframes", people: Sequence[str] | None = None) -> Copies:
    """Read what all annotators have a pose of.

    Args:
        sessions: at least two copies of one session.
        poses: `keyframes` for poses that a person set or verified, `all` for tracked ones too.
        people: names; all by default.

    Raises:
        SessionError: the sessions differ in cameras, people or frames, or have no pose in common.
    """
    check_same_recording(sessions)
    bodies: dict[Subject, tuple[PosedBody, ...]] = {}
    for person in sessions[0].people:
        if people is None or person.name in people:
            found = [_annotated(session, person.name, poses) for session in sessions]
            common = sorted(set(found[0]).intersection(*found[1:]))
            bodies |= {Subject(person.name, frame): tuple(f[frame].body for f in found) for frame in common}
    names = annotator_names([s.folder for s in sessions])
    if not bodies:
        kind, other = ("keyframe", ", or compare all poses") if poses == "keyframes" else ("pose", "")
        raise SessionError(
            f"expected a frame in which {' and '.join(names)} have a {kind} of the same person, found none; annotate "
            f"the same frames in each copy{other}"
        )
    joints = (*JOINTS, *FOOT_POINTS)
    points = np.array([[joint_centers(body, joints) for body in of] for of in bodies.values()])
    known = np.asarray(np.isfinite(points).all(axis=(1, 3)).any(axis=0))
    joints = tuple(joint for joint, is_known in zip(joints, known, strict=True) if is_known)
    notes = notes_on(sessions, bodies)
    return Copies(
        names, tuple(bodies), joints, points[:, :, known], *_angles(list(bodies.values())), sessions[0].fps, notes
    )


def check_same_recording(sessions: Sequence[Session]) -> None:
    """Check that sessions are copies of one.

    Raises:
        SessionError: they differ in cameras, people or frames.
    """
    first, *others = sessions
    for other in others:
        for what, a, b in (
            ("cameras", _cameras(first), _cameras(other)),
            ("people", _people(first), _people(other)),
            ("frames", str(first.n_frames), str(other.n_frames)),
        ):
            if a != b:
                raise SessionError(
                    f"expected copies of one session, found {what} {a} in {first.folder} and {b} in {other.folder}; "
                    "give copies of the same recording"
                )


def annotator_names(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return the shortest ends of paths that tell folders apart: `ann`, or `ann/walk` and `ben/walk`."""
    parts = [folder.resolve().parts for folder in folders]
    for n in range(1, max(map(len, parts)) + 1):
        names = tuple("/".join(p[-n:]) for p in parts)
        if len(set(names)) == len(names):
            return names
    raise SessionError(f"expected different session folders, found {folders[0]} twice; give two copies of a session")


def _cameras(session: Session) -> str:
    return ", ".join(sorted(f"{c.camera.name} ({c.camera.width}x{c.camera.height})" for c in session.cameras))


def _people(session: Session) -> str:
    return ", ".join(sorted(p.name for p in session.people))


def _annotated(session: Session, name: str, poses: Poses) -> dict[int, StoredPose]:
    model = next(p.model for p in session.people if p.name == name)
    stored = read_stored_poses(session.annotations_path, name, model)
    return {f: p for f, p in stored.items() if poses == "all" or is_annotated(p.record.keyframe, p.source)}


def is_annotated(keyframe: bool, source: str) -> bool:
    """Return whether a person set or verified a pose, by its mark and the most manual source of its values."""
    return keyframe or source in ("manual", "pinned")


def joint_centers(body: PosedBody, joints: Sequence[str]) -> Array:
    """Return the centres of joints, (n_joints, 3), world, metres; NaN for one that the body lacks."""
    known = dict(zip(body.model.point_names, body.joint_centers_world, strict=True))
    return np.array([known.get(joint, np.full(3, np.nan)) for joint in joints])


def farthest_joint(a: PosedBody, b: PosedBody) -> tuple[str, float] | None:
    """Return the joint whose centres are farthest apart in two poses of a person, and their distance, metres.

    The poses are compared in their own bodies, by the joints that both have; None if there is none.
    """
    joints = (*JOINTS, *FOOT_POINTS)
    apart_m = np.linalg.norm(joint_centers(a, joints) - joint_centers(b, joints), axis=1)
    if not np.isfinite(apart_m).any():
        return None
    at = int(np.nanargmax(apart_m))
    return joints[at], float(apart_m[at])


def _angles(subjects: Sequence[tuple[PosedBody, ...]]) -> tuple[tuple[str, ...], Array, Array]:
    """Return names, consensus and steps of the angles, as `Copies` has them."""
    models = [bodies[0].model for bodies in subjects]
    shared = [all(b.model.dof_names == bodies[0].model.dof_names for b in bodies) for bodies in subjects]
    of_shared = [m for m, ok in zip(models, shared, strict=True) if ok]
    dofs_of = {model: np.flatnonzero(~model.dof_is_length).tolist() for model in of_shared}
    names = tuple(dict.fromkeys(model.dof_names[d] for model, dofs in dofs_of.items() for d in dofs))
    column = {name: i for i, name in enumerate(names)}
    means = np.full((len(subjects), len(names)), np.nan)
    steps = np.full((len(subjects), len(subjects[0]), len(names)), np.nan)
    for i, (bodies, model) in enumerate(zip(subjects, models, strict=True)):
        if not shared[i]:
            continue
        mean = mean_pose(model, [b.values for b in bodies])
        dofs = dofs_of[model]
        columns = [column[model.dof_names[d]] for d in dofs]
        steps[i][:, columns] = pose_steps(model, [b.values for b in bodies], mean)[:, dofs]
        plain = [d for d in dofs if model.dof_names[d] in model.value_names]
        means[i, [column[model.dof_names[d]] for d in plain]] = mean[model.dof_value[plain]]
    return names, means, steps


def notes_on(sessions: Sequence[Session], bodies: Mapping[Subject, tuple[PosedBody, ...]]) -> tuple[str, ...]:
    """Return sentences on what differs beside the poses: calibrations and bodies."""
    out = list[str]()
    cameras = [sorted((c.camera for c in s.cameras), key=lambda camera: camera.name) for s in sessions]
    matrices = [np.array([(c.K @ c.T_camera_world[:3]) for c in of]) for of in cameras]
    if not all(np.allclose(m, matrices[0]) for m in matrices):
        out.append("the copies have different calibrations, and distances include that difference")
    texts = {body.model: format_model(body.model) for of in bodies.values() for body in of}
    for person in dict.fromkeys(subject.person for subject in bodies):
        of_person = [[body.model for body in of] for subject, of in bodies.items() if subject.person == person]
        if any(len({m.dof_names for m in models}) > 1 for models in of_person):
            out.append(f"the bodies of '{person}' have different degrees of freedom, and their angles are not compared")
        if any(len({texts[m] for m in models}) > 1 for models in of_person):
            out.append(f"the bodies of '{person}' have different sizes, and distances of joints include them")
        joints = {*JOINTS, *FOOT_POINTS}
        if any(not joints.intersection(*(m.point_names for m in models)) for models in of_person):
            out.append(f"the bodies of '{person}' have no joint in common, and their joints are not compared")
    return tuple(out)


def mean_pose(model: BodyModel, poses: Sequence[Array]) -> Array:
    """Return the mean of poses on the manifold of the body's joints, (n_values,).

    Angles are averaged the shorter way round. The mean of ball joints is that of rotations (Karcher mean), found by
    averaging the steps from the present mean.

    Args:
        model: the body of all.
        poses: (n_values,) each; at least one.
    """
    mean = np.array(poses[0], dtype=np.float64)
    while True:
        step = pose_steps(model, poses, mean).mean(axis=0)
        mean = model.retract(mean, step)
        if float(np.abs(step).max()) < TINY:  # rad and metres; the steps shrink quadratically
            return nearest_equivalent(model, mean, mean)


def pose_steps(model: BodyModel, poses: Sequence[Array], start: Array) -> Array:
    """Return the steps from one pose to others in the degrees of freedom, angles the shorter way round, (k, n_dofs)."""
    return np.array([shortest_step(model, pose, start) for pose in poses])


def mean_points(points: Array) -> Array:
    """Return the mean over the annotators of points, (n, k, m, 3) to (n, m, 3), metres."""
    return np.asarray(points.mean(axis=1))
