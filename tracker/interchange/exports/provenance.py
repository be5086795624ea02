"""Provenance of exported poses: who made each, how, in which body and calibration, and how sure its joints are.

`pose_arrays` has them with the poses as arrays over frames, people and points; `point_origins` has who placed each
point, when, and in which views.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.files import write_text_atomic
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, PersonMotion, file_from_world
from tracker.session.store.edit_tree import program_version
from tracker.session.store.records import SEEN, SOURCES, Pin, PoseRecord

SIDE_FILE = ".provenance.json"
"""End of the name of the file beside one of a format that cannot hold the provenance."""


@dataclass(frozen=True, eq=False)
class PoseProvenance:
    """Provenance of the pose of a person in a frame."""

    record: PoseRecord
    """The pose as stored: status, keyframe, reviewed, author, time, program, body revision."""
    fields: dict[str, str | bool | int]
    """Everything that is known of the whole pose, by the name in files; docs/log/export.md lists it."""
    point_sources: tuple[str, ...]
    """The source of each point of the body, in the order of its `point_names`: see `sources_of_points`."""
    point_lost: Array
    """Probability that the limb of each point is lost, (n_points,); NaN where not assessed, and for the trunk."""

    def covariances(self, R_file_world: Array) -> Array:
        """Return the covariance of each point in the axes of a file, (n_points, 3, 3), m^2; NaN where not known."""
        n_points = len(self.point_sources)
        errors = self.record.errors
        if errors is None:
            return np.full((n_points, 3, 3), np.nan)
        return np.asarray(R_file_world @ errors @ R_file_world.T)


def pose_provenance(motion: ExportedMotion, person: PersonMotion, frame: int) -> PoseProvenance:
    """Return the provenance of the exported pose of a person in a frame."""
    stored = person.poses[frame]
    model, record = stored.body.model, stored.record
    revision = motion.calibration_of(person, frame)
    verified = motion.verifications.get((person.person.name, frame))
    fields: dict[str, str | bool | int] = {
        "status": record.status,
        "source": stored.source,
        "annotator": record.author,
        "edit_time": record.time,
        "program": record.program,
        "remark": record.remark,
        "verified_by": verified.author if verified else "",
        "verified_time": verified.time if verified else "",
        "keyframe": record.keyframe,
        "reviewed": record.reviewed or record.keyframe,
        "body_revision": record.model_revision,
        "calibration_revision": revision,
        "earlier_calibration": revision != motion.calibrations.present,
    }
    sources = sources_of_points(model, record.sources)
    return PoseProvenance(record, fields, sources, point_lost(model, record.limbs_lost))


def sources_of_points(model: BodyModel, sources: Sequence[str]) -> tuple[str, ...]:
    """Return the source of each point of a body: the most manual one of the values of the nearest joint that moves it.

    Args:
        model: the body.
        sources: of the values of its pose, (n_values,).
    """
    return tuple(min((sources[i] for i in values), key=SOURCES.index) for values in values_of_points(model))


def values_of_points(model: BodyModel) -> tuple[tuple[int, ...], ...]:
    """Return the indices of the values of the nearest joint that moves each point, in the order of `point_names`."""
    values_of: dict[str, list[int]] = {}
    for i, name in enumerate(model.value_names):
        values_of.setdefault(name.rpartition(".")[0], []).append(i)
    out = []
    for part in model.proximal_parts.tolist():
        while part > 0 and model.joints[part].name not in values_of:
            part = model.parents[part]
        out.append(tuple(values_of[model.joints[part].name]))
    return tuple(out)


def point_lost(model: BodyModel, limbs_lost: Sequence[float]) -> Array:
    """Return the probability that the limb of each point is lost, (n_points,); NaN where not known."""
    of_part = np.full(len(model.parts), np.nan)
    for limb, lost in zip(limbs(model), limbs_lost, strict=False):
        of_part[limb.parts] = lost
    return np.asarray(of_part[model.proximal_parts])


def write_provenance(path: Path, motion: ExportedMotion, options: ExportOptions) -> None:
    """Write the provenance of exported poses as JSON.

    Args:
        path: the file.
        motion: the poses.
        options: `axes` are those in which covariances are stated.

    Raises:
        OSError: the file cannot be written.
    """
    text = msgspec.json.encode(provenance_document(motion, options)).decode()
    write_text_atomic(path, text + "\n")


def provenance_document(motion: ExportedMotion, options: ExportOptions) -> dict[str, Any]:
    """Return the provenance of exported poses as it is written to JSON. docs/log/export.md describes the keys."""
    R_file_world = file_from_world(motion.session, options.axes)[:3, :3]
    bodies: dict[str, Any] = {}
    people: dict[str, Any] = {}
    for person in motion.exported:
        poses = []
        for frame, stored in sorted(person.poses.items()):
            found = pose_provenance(motion, person, frame)
            poses.append({"frame": frame, "time_s": motion.time_s(frame), **_pose_document(found, R_file_world)})
            model = stored.body.model
            bodies[str(stored.record.model_revision)] = {
                "name": model.name, "height_m": model.height_m, "points": model.point_names,
            }  # fmt: skip
        people[person.person.name] = poses
    return {
        "content": "provenance of poses exported by Quadrille",
        "version": 1,
        "program": program_version(),
        "session": motion.session.name,
        "fps": motion.session.fps,
        "axes": options.axes,
        "calibration_revision": motion.calibrations.present,
        "bodies": bodies,
        "people": people,
    }


def _pose_document(found: PoseProvenance, R_file_world: Array) -> dict[str, Any]:
    record = found.record
    covariances = found.covariances(R_file_world)
    upper = covariances[:, (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)]
    return {
        **found.fields,
        "point_sources": found.point_sources,
        "point_lost": [None if np.isnan(x) else round(x, 4) for x in found.point_lost.tolist()],
        "covariances_m2": None
        if record.errors is None
        else [[float(f"{x:.6g}") for x in row] for row in upper.tolist()],
    }


class PointOrigin(NamedTuple):
    """Origin of a point of a pose."""

    source: str
    """The most manual source of the values that place it, one of `SOURCES`."""
    author: str
    """Author of the edit that gave it this source; empty for nobody named."""
    time: str
    """Time of this edit, ISO 8601, UTC."""
    views: tuple[str, ...]
    """Cameras in which a person put the point, or pinned it, by name."""


def point_origins(
    model: BodyModel, versions: Sequence[PoseRecord], pins: Sequence[Pin] = ()
) -> tuple[PointOrigin, ...]:
    """Return the origin of each point of the present pose, in the order of the body's `point_names`.

    An edit of one limb leaves the values of the others as they were. So the author of a point is that of the earliest
    version since which its most manual values and their source are unchanged.

    Args:
        model: the body of the present pose.
        versions: the present pose and those before it, the present one first; at least one.
        pins: of the person on the frame.
    """
    present = versions[0]
    seen: Mapping[str, Mapping[str, object]] = present.settings.get(SEEN, {})
    pinned: dict[str, set[str]] = {}
    for pin in pins:
        pinned.setdefault(pin.point, set()).add(pin.camera)
    out = []
    for name, values in zip(model.point_names, values_of_points(model), strict=True):
        source = min((present.sources[i] for i in values), key=SOURCES.index)
        made = _made(versions, [i for i in values if present.sources[i] == source])
        views = sorted({*seen.get(name, {}), *pinned.get(name, ())})
        out.append(PointOrigin(source, made.author, made.time, tuple(views)))
    return tuple(out)


def _made(versions: Sequence[PoseRecord], values: Sequence[int]) -> PoseRecord:
    """Return the earliest version since which some values, by index, and their sources are those of the first one."""
    present, made = versions[0], versions[0]
    for version in versions[1:]:
        if version.model_revision != present.model_revision or len(version.values) != len(present.values):
            break
        if any((version.values[i], version.sources[i]) != (present.values[i], present.sources[i]) for i in values):
            break
        made = version
    return made


@dataclass(frozen=True, eq=False)
class PoseArrays:
    """The poses of F frames, P people and n points. Those of a person who has none in a frame are NaN or empty."""

    frames: IntArray
    """Frames of the session, (F,), ascending."""
    times_s: Array
    """Their times, (F,)."""
    people: tuple[str, ...]
    """Names, (P,)."""
    points: tuple[str, ...]
    """Names of the points of all bodies, (n,)."""
    bones: tuple[tuple[str, str], ...]
    """Pairs of points that a stick figure connects."""
    joints: Array
    """Joint centres, (F, P, n, 3), metres, in the axes of the file; NaN also for points that a body lacks."""
    covariances: Array
    """Of the joint centres in the axes of the file, (F, P, n, 3, 3), m^2; NaN where not known."""
    point_sources: NDArray[np.str_]
    """Source of each point, (F, P, n)."""
    point_lost: Array
    """Probability that the limb of each point is lost, (F, P, n); NaN where not assessed."""
    by_pose: dict[str, NDArray[Any]]
    """`PoseProvenance.fields` of each pose by name, (F, P); empty, False or 0 without one."""

    @property
    def errors_m(self) -> Array:
        """Root mean square error of each joint centre, (F, P, n), metres; NaN where not known."""
        return np.asarray(np.sqrt(np.trace(self.covariances, axis1=-2, axis2=-1)))

    @property
    def confidence(self) -> Array:
        """Probability that the limb of each point is not lost, (F, P, n): 1 where not assessed, NaN without a point."""
        return np.where(np.isnan(self.joints[..., 0]), np.nan, 1.0 - np.nan_to_num(self.point_lost))


def pose_arrays(motion: ExportedMotion, options: ExportOptions, tick: Tick = lambda: None) -> PoseArrays:
    """Return the exported poses and their provenance as arrays, in the axes of a file; call `tick` after each frame."""
    models = [model for person in motion.exported for model in person.models]
    names = tuple(dict.fromkeys(name for model in models for name in model.point_names))
    bones = tuple(dict.fromkeys(bone for model in models for bone in model.bones))
    columns = {model: [names.index(n) for n in model.point_names] for model in models}
    people = motion.exported
    shape = (len(motion.frames), len(people))
    out = PoseArrays(
        frames=np.array(motion.frames),
        times_s=np.array([motion.time_s(f) for f in motion.frames]),
        people=tuple(p.person.name for p in people),
        points=names,
        bones=bones,
        joints=np.full((*shape, len(names), 3), np.nan),
        covariances=np.full((*shape, len(names), 3, 3), np.nan),
        point_sources=np.full((*shape, len(names)), "", "<U16"),
        point_lost=np.full((*shape, len(names)), np.nan),
        by_pose={},
    )
    by_pose: dict[str, NDArray[Any]] = {}
    T_file_world = file_from_world(motion.session, options.axes)
    for i, frame in enumerate(motion.frames):
        for j, person in enumerate(people):
            if frame not in person.poses:
                continue
            body, found = person.poses[frame].body, pose_provenance(motion, person, frame)
            at = (i, j, columns[body.model])
            out.joints[at] = rigid.apply(T_file_world, body.joint_centers_world)
            out.covariances[at] = found.covariances(T_file_world[:3, :3])
            out.point_sources[at], out.point_lost[at] = found.point_sources, found.point_lost
            for name, value in found.fields.items():
                by_pose.setdefault(name, np.full(shape, type(value)(), object))[i, j] = value
        tick()
    out.by_pose.update({name: found.astype(type(found[0, 0])) for name, found in by_pose.items()})
    return out


def pose_values(motion: ExportedMotion) -> tuple[list[str], Array]:
    """Return the names of the values of all bodies, and the values of each pose, (F, P, n_values); NaN without one."""
    names = list(dict.fromkeys(v for person in motion.exported for model in person.models for v in model.value_names))
    poses = np.full((len(motion.frames), len(motion.exported), len(names)), np.nan)
    for j, person in enumerate(motion.exported):
        for i, frame in enumerate(motion.frames):
            if stored := person.poses.get(frame):
                poses[i, j, [names.index(v) for v in stored.body.model.value_names]] = stored.body.values
    return names, poses
