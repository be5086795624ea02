"""Read the stored poses of a session that are exported; the options of an export, and the axes of its files."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.interpolation import interpolate_pose
from tracker.body.motion.pose_steps import velocity
from tracker.errors import Remedy, SessionError, TrackerError
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import up_rotation
from tracker.session.session import Person, Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import PosedRevisions, read_posed_revisions
from tracker.session.store.stored_poses import StoredPose, read_stored_poses
from tracker.session.store.task_log import StateRow

AxesName = Literal["calibration", "y-up"]
UnitName = Literal["m", "mm"]
KeypointSet = Literal["all", "coco17", "body"]
PicturesName = Literal["images", "video"]
PixelsName = Literal["original", "undistorted"]
FacesName = Literal["shown", "blurred"]
MeshName = Literal["ply", "obj", "stl", "glb"]


@dataclass(frozen=True)
class ExportOptions:
    """Options of all formats; each format has some of them."""

    axes: AxesName = "calibration"
    """calibration: the world of the session; y-up: y points up from the floor."""
    units: UnitName = "m"
    """Unit of lengths."""
    keypoints: KeypointSet = "all"
    """COCO: the 17 keypoints of people, those of the body model, or both."""
    view: str | None = None
    """Overlay video: name of the camera; None for a grid of all."""
    character: str | None = None
    """Overlay video: body that moves as the person beside the footage, a preset or a file; see `load_character`."""

    pixels: PixelsName = "original"
    """Pixels of points and masks: those of the footage, or without lens distortion, with such pictures and cameras."""
    pictures: PicturesName = "images"
    """Dataset: an image of each exported frame, or the footage as it is."""
    faces: FacesName = "shown"
    """Heads in pictures: as filmed, or blurred; see `tracker.interchange.exports.faces`."""
    mesh: MeshName = "ply"
    """Meshes: format of their files."""
    provenance: bool = False
    """Whether a file beside one that cannot hold it has the provenance of the poses."""

    @property
    def per_metre(self) -> float:
        """Units per metre."""
        return 1000.0 if self.units == "mm" else 1.0


def load_character(text: str) -> BodyModel:
    """Return the body of a character: a preset or the path of a .toml file, and `:METRES` for its height.

    Raises:
        TrackerError: there is no such body, or the height is none.
    """
    name, _, height = text.rpartition(":") if re.search(r":[\d.]+$", text) else (text, "", "")
    try:
        height_m = float(height) if height else None
    except ValueError:
        height_m = np.nan
    if height_m is not None and not 0.3 <= height_m <= 3.0:
        raise TrackerError(
            f"expected a height of 0.3 to 3 metres after the body, found '{text}'; give one as {name}:1.2"
        )
    return load_model(name, height_m)


def file_from_world(session: Session, axes: AxesName) -> Array:
    """Return the transform from the session's world to the axes of a file, (4, 4), metres.

    In y-up axes, y is the height above the floor. A world in which z points up becomes (x, z, -y).
    """
    if axes == "calibration":
        return np.eye(4)
    R_world_up = up_rotation(session.up, session.floor)
    origin_world = np.zeros(3) if session.floor is None else session.floor.origin_world
    y_up = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return rigid.transform(y_up) @ rigid.inverse(rigid.transform(R_world_up, origin_world))


def up_in_file(session: Session, axes: AxesName) -> Array:
    """Return the unit vector that points up in the axes of a file, (3,)."""
    return file_from_world(session, axes)[:3, :3] @ up_rotation(session.up, session.floor)[:, 2]


Checked = Literal["keyframes", "reviewed"]
"""Poses that a person set or verified, or that a person has checked; a keyframe is one of both."""


@dataclass(frozen=True, eq=False)
class PersonMotion:
    """The stored poses of one person."""

    index: int
    """Of the person in the session."""
    person: Person
    poses: Mapping[int, StoredPose]
    """By frame; a frame may be missing."""
    around: Mapping[int, StoredPose] = field(default_factory=dict)
    """The same, with those of two frames before and after the exported ones."""
    unselected: frozenset[int] = frozenset()
    """Frames with a pose in `around` that is not exported, but occludes others."""

    @cached_property
    def model(self) -> BodyModel:
        """The one body of files with a skeleton: that of all poses if they agree, else the person's present one."""
        return self.models[0] if len(self.models) == 1 else self.person.model

    @cached_property
    def models(self) -> list[BodyModel]:
        """The bodies of all poses, each once, in the order of frames."""
        return list(dict.fromkeys(p.body.model for p in self.poses.values()))

    @property
    def n_refitted(self) -> int:
        """Number of poses that belong to another body than `model`."""
        return sum(p.body.model is not self.model for p in self.poses.values())

    def body(self, frame: int) -> PosedBody:
        """Return the body on a frame with a pose, exported or not."""
        return (self.poses[frame] if frame in self.poses else self.around[frame]).body

    def moving(self, frame: int) -> PosedBody:
        """Return the body on a frame with a pose, with its velocity by the poses around it in the same body."""
        body = self.body(frame)
        near = {k: p.body for k, p in self.around.items() if abs(k - frame) <= 2}
        same = {k: b.values for k, b in near.items() if b.model is body.model}
        return replace(body, velocity=velocity(body.model, same, frame))

    def in_one_body(self) -> dict[int, Array]:
        """Return the poses in the body `model` by frame, (n_values,); those of other sizes are refitted to it.

        Raises:
            SessionError: some poses are of a body with other degrees of freedom.
        """
        other = next((m for m in self.models if m.value_names != self.model.value_names), None)
        if other is not None:
            expected = f"poses of '{self.person.name}' with the degrees of freedom of '{self.model.name}'"
            raise SessionError.mismatch("", expected, f"some of '{other.name}'", Remedy("frames_of_one_body"))
        return {f: retarget_pose(p.body.values, p.body.model, self.model) for f, p in self.poses.items()}

    def without_gaps(self, frames: Sequence[int]) -> Array:
        """Return a pose of the body `model` for each frame, (n, n_values).

        A gap is interpolated; before the first pose and after the last one the body stands still.
        """
        poses = self.in_one_body()
        known = sorted(poses)
        out = np.empty((len(frames), len(self.model.value_names)))
        for i, frame in enumerate(frames):
            at = int(np.searchsorted(known, frame))
            if frame in poses:
                out[i] = poses[frame]
            elif at in (0, len(known)):
                out[i] = poses[known[0 if at == 0 else -1]]
            else:
                first, last = known[at - 1], known[at]
                share = np.array([(frame - first) / (last - first)])
                out[i] = interpolate_pose(self.model, poses[first], poses[last], share)[0]
        return out


@dataclass(frozen=True, eq=False)
class ExportedMotion:
    """The poses of a session that are exported."""

    session: Session
    frames: Sequence[int]
    """Ascending; files with a constant rate have all of `span`."""
    people: tuple[PersonMotion, ...]
    """All people of the session, because they occlude one another."""
    chosen: tuple[int, ...]
    """Indices of those who are exported; each has a pose."""
    n_lost: int
    """Number of poses of exported people whose status is lost; they are in `people` unless they were left out."""
    calibrations: PosedRevisions = field(default_factory=PosedRevisions)
    """The present calibration, and those that the poses were made with."""
    verifications: Mapping[tuple[str, int], StateRow] = field(default_factory=dict)
    """The decisions by which poses are verified, by name of the person and frame."""

    @property
    def exported(self) -> tuple[PersonMotion, ...]:
        """The people who are exported."""
        return tuple(self.people[i] for i in self.chosen)

    @property
    def span(self) -> range:
        """All frames from the first to the last one."""
        return range(self.frames[0], self.frames[-1] + 1)

    @property
    def n_missing(self) -> int:
        """Number of frames without a pose, over the people who are exported."""
        return sum(len(self.frames) - len(p.poses) for p in self.exported)

    def calibration_of(self, person: PersonMotion, frame: int) -> int:
        """Return the revision of the calibration that a pose was made with."""
        return self.calibrations.of(person.person.name, frame)

    @property
    def n_earlier(self) -> int:
        """Number of poses of exported people that were made with another calibration than the present one."""
        present = self.calibrations.present
        return sum(self.calibration_of(p, frame) != present for p in self.exported for frame in p.poses)

    @property
    def calibration_note(self) -> str:
        """Sentence on the calibration, for files that hold text."""
        total = sum(len(p.poses) for p in self.exported)
        earlier = f"; {self.n_earlier} of {total} poses are of an earlier one" if self.n_earlier else ""
        return f"calibration revision {self.calibrations.present} of the session{earlier}"

    def time_s(self, frame: int) -> float:
        """Return the time of a frame of the session, s."""
        return frame / self.session.fps

    def bodies(self, frame: int) -> list[tuple[PersonMotion, PosedBody]]:
        """Return the people who are in the scene in a frame, with their bodies, and velocities if a view needs them.

        This includes people whose pose is not exported, see `is_exported`.
        """
        shown = [p for p in self.people if frame in p.poses or frame in p.unselected]
        if any(c.clock.offset_frames(frame) for c in self.session.cameras):
            return [(p, p.moving(frame)) for p in shown]
        return [(p, p.body(frame)) for p in shown]

    def is_exported(self, person: PersonMotion, frame: int) -> bool:
        """Return whether the pose of a person in a frame is exported."""
        return person.index in self.chosen and frame in person.poses


def read_motion(
    session: Session,
    chosen: Sequence[int],
    frames: Sequence[int] | None = None,
    skip_lost: bool = False,
    only: Checked | None = None,
) -> ExportedMotion:
    """Read the stored poses of a session.

    Args:
        session: the session; other programs may have it open.
        chosen: indices of the people to export. Of several, those without a pose are left out.
        frames: ascending; by default from the first to the last pose of these people.
        skip_lost: treat poses whose status is lost as missing, but for keyframes. They occlude nobody.
        only: leave out poses that no person has set or verified ("keyframes"), or that nobody has checked ("reviewed"),
            and frames without a pose that is left. People who are left out still occlude others.

    Raises:
        SessionError: nobody has such a pose in these frames.
    """
    within = range(session.n_frames) if frames is None else frames
    wanted = frozenset(within)
    people, n_lost = [], 0
    for index, person in enumerate(session.people):
        wider = range(max(0, within[0] - 2), within[-1] + 3)
        around = read_stored_poses(session.annotations_path, person.name, person.model, wider)
        stored = {frame: pose for frame, pose in around.items() if frame in wanted}
        lost = {f for f, pose in stored.items() if pose.record.status == "lost" and not pose.record.keyframe}
        n_lost += len(lost) * (index in chosen)
        present = {f: p for f, p in stored.items() if not skip_lost or f not in lost}
        poses = {f: p for f, p in present.items() if _is_checked(p, only)}
        people.append(PersonMotion(index, person, poses, around, frozenset(present.keys() - poses.keys())))
    having = tuple(i for i in chosen if people[i].poses)
    if not having:
        raise _no_poses([people[i] for i in chosen], frames, n_lost > 0, only)
    found = sorted({frame for i in having for frame in people[i].poses})
    if only is not None:
        within = found
    elif frames is None:
        within = range(found[0], found[-1] + 1)
    calibrations = read_posed_revisions(session.annotations_path, [p.name for p in session.people])
    with AnnotationStore(session.annotations_path, read_only=True) as store:
        verifications = store.tasks.verifications()
    return ExportedMotion(session, within, tuple(people), having, n_lost, calibrations, verifications)


def _is_checked(pose: StoredPose, only: Checked | None) -> bool:
    return only is None or pose.record.keyframe or (only == "reviewed" and pose.record.reviewed)


def _no_poses(
    people: Sequence[PersonMotion], frames: Sequence[int] | None, has_lost: bool, only: Checked | None
) -> SessionError:
    """Return the error of an export without poses."""
    names = " and ".join(f"'{p.person.name}'" for p in people)
    where = "" if frames is None else f" in frames {frames_text(frames)}"
    reasons = [" that is not lost"] * has_lost
    if only is not None and any(p.unselected for p in people):
        reasons.append({"keyframes": " that is a keyframe", "reviewed": " that is reviewed"}[only])
    remedy = Remedy("place_body") if len(reasons) == has_lost else Remedy("export_all_poses")
    return SessionError(f"expected poses of {names}{where}, found none{''.join(reasons)}", remedy)


def frames_text(frames: Sequence[int]) -> str:
    """Return frames as a person writes them: A:B, half open, or 3,7,12."""
    return f"{frames[0]}:{frames[-1] + 1}" if isinstance(frames, range) else ",".join(map(str, frames))
