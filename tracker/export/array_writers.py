"""Write a motion to files that are arrays over frames, people and points, one function for each format."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tracker.export.motion import ExportedMotion
from tracker.export.options import ExportOptions, file_from_world
from tracker.export.pose_arrays import pose_arrays
from tracker.footage.camera_source import CameraSource
from tracker.formats.interchange.c3d import write_c3d
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array


def write_person_c3d(
    motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Callable[[], None]
) -> None:
    """Write the points of one person as C3D; residuals are the errors that the audit expects."""
    found = pose_arrays(motion, options)
    write_c3d(
        paths[0], found.points, found.joints[:, 0], motion.session.fps,
        first_frame=motion.frames[0], residuals=found.errors_m[:, 0], units=options.units,
    )  # fmt: skip
    for _ in motion.frames:
        tick()


def write_npz(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Callable[[], None]) -> None:
    """Write poses, joint centers, covariances, provenance and cameras as arrays of NumPy; docs/export.md lists them."""
    found = pose_arrays(motion, options)
    arrays: dict[str, Any] = {
        "format_version": 1,
        "session": motion.session.name,
        "fps": motion.session.fps,
        "axes": options.axes,
        "T_file_world": file_from_world(motion.session, options.axes),
        "frames": found.frames,
        "times_s": found.times_s,
        "people": found.people,
        "points": found.points,
        "bones": np.array(found.bones),
        "joints": found.joints,
        "covariance": found.covariances,
        "point_source": found.point_sources,
        "point_lost": found.point_lost,
        **found.texts,
        "keyframe": found.keyframe,
        "reviewed": found.reviewed,
        "body_revision": found.body_revision,
        "calibration_revision": found.calibration_revision,
        "earlier_calibration": found.earlier_calibration,
    }
    arrays |= _values(motion) | _cameras(motion.session.cameras)
    plain = {name: np.asarray(values) for name, values in arrays.items()}
    assert not any(values.dtype.hasobject for values in plain.values()), "readers refuse pickled objects"
    np.savez_compressed(paths[0], **plain)  # type: ignore[arg-type]
    for _ in motion.frames:
        tick()


def _values(motion: ExportedMotion) -> dict[str, Any]:
    """Return the values of the poses, and the bodies that they belong to."""
    names = list(dict.fromkeys(v for person in motion.exported for model in person.models for v in model.value_names))
    poses = np.full((len(motion.frames), len(motion.exported), len(names)), np.nan)
    bodies = {}
    for j, person in enumerate(motion.exported):
        for i, frame in enumerate(motion.frames):
            if stored := person.poses.get(frame):
                model = stored.body.model
                poses[i, j, [names.index(v) for v in model.value_names]] = stored.body.values
                bodies[stored.record.model_revision] = model
    revisions = sorted(bodies)
    return {
        "values": names,
        "poses": poses,
        "bodies": revisions,
        "body_models": [format_model(bodies[r]) for r in revisions],
    }


def _cameras(sources: Sequence[CameraSource]) -> dict[str, Any]:
    """Return the cameras as arrays; distortion coefficients that a lens lacks are 0."""
    cameras = [source.camera for source in sources]
    n_coefficients = max(camera.distortion.size for camera in cameras)
    distortion: list[Array] = [np.pad(c.distortion, (0, n_coefficients - c.distortion.size)) for c in cameras]
    return {
        "cameras": [camera.name for camera in cameras],
        "camera_size": [camera.size for camera in cameras],
        "camera_K": [camera.K for camera in cameras],
        "camera_distortion": distortion,
        "camera_fisheye": [camera.fisheye for camera in cameras],
        "camera_T_world_camera": [camera.T_world_camera for camera in cameras],
        "camera_offset": [source.offset for source in sources],
        "camera_clock": [(source.clock.ahead_frames, source.clock.rate) for source in sources],
        "camera_footage": [source.footage.name for source in sources],
    }
