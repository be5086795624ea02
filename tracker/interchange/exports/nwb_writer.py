"""Write a motion as NWB with the types of ndx-pose for several cameras.

Each person is a `MultiCameraPoseEstimation`, which holds a series for each point in space, and a `PoseEstimation` for
each view. Devices are calibrated cameras; a table has the provenance of each pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from tracker.body.model import BodyModel
from tracker.footage.camera_source import CameraSource
from tracker.formats.file_names import identifier, identifiers
from tracker.formats.write_only.optional_packages import require
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, file_from_world
from tracker.interchange.exports.provenance import PoseArrays, pose_arrays
from tracker.interchange.exports.views import view_arrays
from tracker.session.store.edit_tree import program_version

_SPACE = {
    "calibration": "the world of the calibration of the cameras",
    "y-up": "the floor at y = 0; x, y, z are x, height, -y of the calibrated world if that is z-up",
}
_COLUMNS = {
    "frame": "frame of the session, from 0",
    "status": "good, doubtful, lost, or empty where no tracker has assessed the pose, or there is none",
    "source": "most manual source of the values of the pose; empty without a pose",
    "annotator": "author of the edit that made the pose",
    "edit_time": "time of that edit, ISO 8601, UTC",
    "program": "version of Quadrille that made it",
    "remark": "reason of the status",
    "verified_by": "who verified the pose as a task of the plan; empty for nobody",
    "verified_time": "time of that, ISO 8601, UTC",
    "keyframe": "whether a person set or verified the pose",
    "reviewed": "whether a person has checked it",
    "body_revision": "body that the pose was made with, from 1; 0 without a pose",
    "calibration_revision": "calibration that it was made with, from 1; 0 without a pose",
    "earlier_calibration": "whether the session has another calibration now",
    "point_source": "source of each point",
    "point_lost": "probability that the limb of each point is lost; NaN where not assessed, and for the trunk",
    "covariance": "covariance of each point in space, in the order of the skeleton's nodes, m^2; NaN where not known",
}
"""Descriptions of the columns of provenance, most of them `PoseArrays.by_pose`."""
_CONFIDENCE = "probability that the limb of the point is not lost; 1 where not assessed"


@dataclass(frozen=True, eq=False)
class _Types:
    """The packages that make the objects of a file, and what their series have in common."""

    pynwb: Any
    pose: Any
    start_s: float
    """Time of the first frame."""
    fps: float
    space: str
    """The axes of points in space, in words."""


def write_poses_nwb(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write joint centers in space and in all views, skeletons, cameras and provenance of all people.

    Raises:
        FormatError: a package is missing.
        OSError: the file cannot be written.
    """
    session, version = motion.session, program_version()
    found = pose_arrays(motion, options)
    seen = view_arrays(motion, options, found.points, tick)
    start_s = motion.span.start / session.fps
    types = _Types(require("pynwb", "NWB"), require("ndx_pose", "NWB"), start_s, session.fps, _SPACE[options.axes])
    file = types.pynwb.NWBFile(
        session_description=f"{session.name}, exported by Quadrille. The date of the recording is not known.",
        identifier=str(uuid4()),
        session_start_time=datetime.fromtimestamp(0, UTC),  # NWB requires one
        session_id=identifier(session.name),
        source_script_file_name="quadrille export",
        source_script=f"quadrille {version}",
    )
    behavior = file.create_processing_module("behavior", "poses of people, from several calibrated cameras")
    cameras = identifiers(session.camera_names)
    T_world_file = rigid.inverse(file_from_world(session, options.axes))
    named = list(zip(cameras, session.cameras, strict=True))
    devices = [file.add_device(_device(types, name, source, T_world_file)) for name, source in named]
    videos = [_video(types, name, source, session.n_frames) for name, source in named]
    for video in videos:
        file.add_acquisition(video)
    names = identifiers(["Skeletons", *found.people])[1:]
    skeletons = [_skeleton(types, name, person.models) for name, person in zip(names, motion.exported, strict=True)]
    behavior.add(types.pose.Skeletons(skeletons=skeletons))
    for i, (name, skeleton) in enumerate(zip(names, skeletons, strict=True)):
        points = list(dict.fromkeys(point for model in motion.exported[i].models for point in model.point_names))
        at = np.array([found.points.index(point) for point in points])
        nodes, confidence = identifiers(points), found.confidence[:, i, at]
        common = {
            "scorer": "quadrille", "source_software": "Quadrille", "source_software_version": version,
            "skeleton": skeleton,
        }  # fmt: skip
        in_views = [
            types.pose.PoseEstimation(
                name=f"{name}_{camera}",
                description="joint centers in the pixels of the footage, with its lens distortion",
                device=device,
                source_video=video,
                pose_estimation_series=_series(types, nodes, px[:, i, at], confidence),
                **common,
            )
            for camera, device, video, px in zip(cameras, devices, videos, seen.points_px, strict=True)
        ]
        behavior.add(
            types.pose.MultiCameraPoseEstimation(
                name=name,
                description=f"joint centers of {found.people[i]} in space",
                pose_estimation_series=_series(types, nodes, found.joints[:, i, at], confidence),
                pose_estimations=in_views,
                **common,
            )
        )
        behavior.add(_provenance(types, f"{name}_provenance", found, i, at))
    with types.pynwb.NWBHDF5IO(str(paths[0]), "w") as writer:
        writer.write(file)


def _device(types: _Types, name: str, source: CameraSource, T_world_file: Array) -> Any:
    """Return a camera; its pose maps points in space to it."""
    camera = source.camera
    lens = "equidistant model of a fisheye (cv2.fisheye)" if camera.fisheye else "OpenCV's k1, k2, p1, p2, k3, ..."
    T_camera_file = camera.T_camera_world @ T_world_file
    coefficients = camera.distortion if camera.distortion.size else np.zeros(4)
    return types.pose.CalibratedCamera(
        name=name,
        description=f"camera {camera.name}, {camera.width}x{camera.height} px; distortion: {lens}",
        intrinsic_matrix=camera.K.astype(np.float32),
        rotation_matrix=T_camera_file[:3, :3].astype(np.float32),
        translation_vector=T_camera_file[:3, 3].astype(np.float32),
        distortion_coefficients=coefficients.astype(np.float32),
    )


def _video(types: _Types, name: str, source: CameraSource, n_frames: int) -> Any:
    """Return the footage of a camera, which stays where it is."""
    return types.pynwb.image.ImageSeries(
        name=f"{name}_video",
        description=f"frame k of the session is frame k + {source.offset} of the footage",
        external_file=[source.footage.name],
        starting_frame=[0],
        format="external",
        dimension=list(source.camera.size),
        starting_time=-source.offset / types.fps,
        rate=types.fps,
        num_samples=source.footage_frames or n_frames + source.offset,
        unit="n.a.",
    )


def _skeleton(types: _Types, name: str, models: Sequence[BodyModel]) -> Any:
    points = list(dict.fromkeys(point for model in models for point in model.point_names))
    bones = dict.fromkeys(bone for model in models for bone in model.bones)
    edges = np.array([[points.index(a), points.index(b)] for a, b in bones], np.uint8).reshape(-1, 2)
    return types.pose.Skeleton(name=f"{name}_skeleton", nodes=identifiers(points), edges=edges)


def _series(types: _Types, nodes: Sequence[str], points: Array, confidence: Array) -> list[Any]:
    """Return the series of the points of a person, (F, n, D), D = 3 in space and 2 in a view."""
    in_space = points.shape[-1] == 3
    known = np.where(np.isnan(points[..., 0]), np.nan, confidence)
    return [
        types.pose.PoseEstimationSeries(
            name=name,
            data=points[:, i].astype(np.float32),
            unit="meters" if in_space else "pixels",
            reference_frame=types.space if in_space else "the center of the upper left pixel; x right, y down",
            confidence=known[:, i].astype(np.float32),
            confidence_definition=_CONFIDENCE,
            starting_time=types.start_s,
            rate=types.fps,
        )
        for i, name in enumerate(nodes)
    ]


def _provenance(types: _Types, name: str, found: PoseArrays, person: int, points: IntArray) -> Any:
    """Return the provenance of a person's poses, one row for each frame."""
    columns = {
        "frame": found.frames,
        **{key: values[:, person] for key, values in found.by_pose.items()},
        "point_source": found.point_sources[:, person, points],
        "point_lost": found.point_lost[:, person, points],
        "covariance": found.covariances[:, person, points],
    }
    rows = [types.pynwb.core.VectorData(name=k, description=_COLUMNS[k], data=v) for k, v in columns.items()]
    description = f"provenance of the poses of {found.people[person]}"
    return types.pynwb.core.DynamicTable(name=name, description=description, columns=rows)
