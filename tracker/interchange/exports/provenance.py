"""Provenance of exported poses: who made each, how, in which body and calibration, and how sure its joints are."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.files import write_text_atomic
from tracker.geometry.arrays import Array
from tracker.interchange.exports.motion import ExportedMotion, PersonMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world
from tracker.session.store.edit_tree import program_version
from tracker.session.store.records import SOURCES, PoseRecord

SIDE_FILE = ".provenance.json"
"""End of the name of the file beside one of a format that cannot hold the provenance."""


@dataclass(frozen=True, eq=False)
class PoseProvenance:
    """Provenance of the pose of a person in a frame."""

    record: PoseRecord
    """The pose as stored: status, keyframe, reviewed, author, time, program, body revision."""
    source: str
    """The most manual source of its values, one of `SOURCES`."""
    point_sources: tuple[str, ...]
    """The source of each point of the body, in the order of its `point_names`: see `sources_of_points`."""
    point_lost: Array
    """Probability that the limb of each point is lost, (n_points,); NaN where not assessed, and for the trunk."""
    calibration_revision: int
    """The calibration that the pose was made with, from 1."""
    is_earlier_calibration: bool
    """Whether the session has another calibration now."""
    verified_by: str
    """Name of the person who verified it as a task of the plan; empty for nobody."""
    verified_time: str
    """Time of that, ISO 8601, UTC; empty for nobody."""

    @property
    def is_reviewed(self) -> bool:
        """Whether a person has checked it, or set it."""
        return self.record.reviewed or self.record.keyframe

    @property
    def fields(self) -> dict[str, str | bool | int]:
        """Everything that is known of the whole pose, by the name in files; docs/log/export.md lists it."""
        record = self.record
        return {
            "status": record.status,
            "source": self.source,
            "annotator": record.author,
            "edit_time": record.time,
            "program": record.program,
            "remark": record.remark,
            "verified_by": self.verified_by,
            "verified_time": self.verified_time,
            "keyframe": record.keyframe,
            "reviewed": self.is_reviewed,
            "body_revision": record.model_revision,
            "calibration_revision": self.calibration_revision,
            "earlier_calibration": self.is_earlier_calibration,
        }

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
    sources = sources_of_points(model, record.sources)
    is_earlier = revision != motion.calibrations.present
    lost = point_lost(model, record.limbs_lost)
    verified = motion.verifications.get((person.person.name, frame))
    by, time = ("", "") if verified is None else (verified.author, verified.time)
    return PoseProvenance(record, stored.source, sources, lost, revision, is_earlier, by, time)


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
