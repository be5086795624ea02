"""Write a motion to files that are arrays over frames, people and points, one function for each format."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tracker.footage.camera_source import CameraSource
from tracker.formats.model_toml import format_model
from tracker.formats.write_only.c3d import write_c3d
from tracker.formats.write_only.movement_netcdf import PER_POINT, PER_POSE, Variable, write_dataset
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.export_format import Tick
from tracker.interchange.exports.frame_views import view_arrays
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world
from tracker.interchange.exports.pose_arrays import pose_arrays, pose_values
from tracker.interchange.exports.views import exported_cameras


def write_person_c3d(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of one person as C3D; residuals are the errors that the run expects."""
    found = pose_arrays(motion, options, tick)
    write_c3d(
        paths[0], found.points, found.joints[:, 0], motion.session.fps,
        first_frame=motion.frames[0], residuals=found.errors_m[:, 0], units=options.units,
    )  # fmt: skip


def write_npz(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write poses, joint centers, covariances, provenance and cameras as arrays; docs/log/export.md lists them."""
    found, (names, poses) = pose_arrays(motion, options, tick), pose_values(motion)
    bodies = {p.record.model_revision: p.body.model for one in motion.exported for p in one.poses.values()}
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
        **found.by_pose,
        "values": names,
        "poses": poses,
        "bodies": sorted(bodies),
        "body_models": [format_model(bodies[r]) for r in sorted(bodies)],
        **_cameras(motion.session.cameras, exported_cameras(motion, options)),
    }
    plain = {name: np.asarray(values) for name, values in arrays.items()}
    assert not any(values.dtype.hasobject for values in plain.values()), "readers refuse pickled objects"
    np.savez_compressed(paths[0], **plain)  # pyrefly: ignore[bad-argument-type]


def _cameras(sources: Sequence[CameraSource], cameras: Sequence[Camera]) -> dict[str, Any]:
    """Return the cameras as arrays; distortion coefficients that a lens lacks are 0."""
    lost = [(i, *own) for i, source in enumerate(sources) for own in source.clock.lost]
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
        "camera_lost_frames": np.array(lost, dtype=np.int64).reshape(-1, 3),
        "camera_footage": [source.footage.name for source in sources],
    }


def write_movement(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write a dataset of `movement` with the joint centers in space, and another one with the points in all views.

    Raises:
        FormatError: a package is missing.
    """
    found = pose_arrays(motion, options)
    seen = view_arrays(motion, options, found.points, tick)
    attributes = {"fps": motion.session.fps, "session": motion.session.name}
    names = {"time": found.times_s, "keypoints": list(found.points), "individuals": list(found.people)}
    frame: Variable = (("time",), found.frames)
    in_space: dict[str, Variable] = {
        "position": ((*PER_POINT, "space"), found.joints),
        "confidence": (PER_POINT, found.confidence),
        "covariance": ((*PER_POINT, "space", "space_of"), found.covariances),
        "point_source": (PER_POINT, found.point_sources),
        "point_lost": (PER_POINT, found.point_lost),
        "frame": frame,
        **{name: (PER_POSE, values) for name, values in found.by_pose.items()},
    }
    metres = attributes | {"space_unit": "metres", "axes": options.axes}
    write_dataset(paths[0], in_space, names | {"space": list("xyz")}, metres)
    in_views: dict[str, Variable] = {
        "position": (("view", *PER_POINT, "space"), seen.points_px),
        "confidence": (("view", *PER_POINT), np.where(np.isnan(seen.points_px[..., 0]), np.nan, found.confidence)),
        "visibility": (("view", *PER_POINT), seen.visibility),
        "frame": frame,
    }
    views = [source.camera.name for source in motion.session.cameras]
    pixels = attributes | {"space_unit": "pixels", "pixels": options.pixels}
    write_dataset(paths[1], in_views, names | {"space": list("xy"), "view": views}, pixels)
