"""Write a motion as NWB with the types of ndx-pose."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tracker.footage.camera_source import CameraSource
from tracker.formats.write_only.nwb import NwbPerson, NwbRecording, NwbView, write_nwb
from tracker.geometry.arrays import Array
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions, file_from_world
from tracker.interchange.exports.pose_arrays import PoseArrays, pose_arrays
from tracker.interchange.exports.view_arrays import ViewPoints, view_arrays
from tracker.session.store.edit_tree import program_version

_SPACE = {
    "calibration": "the world of the calibration of the cameras",
    "y-up": "the floor at y = 0; x, y, z are x, height, -y of the calibrated world if that is z-up",
}
_COLUMNS = {
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
}
"""Descriptions of `PoseArrays.by_pose`."""


def write_poses_nwb(
    motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Callable[[], None]
) -> None:
    """Write joint centers in space and in all views, skeletons, cameras and provenance of all people.

    Raises:
        FormatError: a package is missing.
    """
    session = motion.session
    found = pose_arrays(motion, options)
    seen = view_arrays(motion, options, found.points, tick)
    T_file_world = file_from_world(session, options.axes)
    views = [_view(source, T_file_world, session.n_frames) for source in session.cameras]
    people = [_person(motion, found, seen, i) for i in range(len(found.people))]
    space, version = _SPACE[options.axes], program_version()
    write_nwb(paths[0], NwbRecording(session.name, motion.span, session.fps, space, version, views, people))


def _view(source: CameraSource, T_file_world: Array, n_frames: int) -> NwbView:
    camera = replace(source.camera, T_world_camera=T_file_world @ source.camera.T_world_camera)
    n = source.footage_frames or n_frames + source.offset
    return NwbView(camera, source.footage.name, source.offset, n)


def _person(motion: ExportedMotion, found: PoseArrays, seen: ViewPoints, i: int) -> NwbPerson:
    """Return a person with the points of their own bodies."""
    models = motion.exported[i].models
    points = list(dict.fromkeys(name for model in models for name in model.point_names))
    columns = np.array([found.points.index(name) for name in points])
    frames = ("frame of the session, from 0", found.frames)
    covariance = "covariance of each point in space, in the order of the skeleton's nodes, m^2; NaN where not known"
    lost = "probability that the limb of each point is lost; NaN where not assessed, and for the trunk"
    provenance = {
        "frame": frames,
        **{name: (_COLUMNS[name], values[:, i]) for name, values in found.by_pose.items()},
        "point_source": ("source of each point", found.point_sources[:, i, columns]),
        "point_lost": (lost, found.point_lost[:, i, columns]),
        "covariance": (covariance, found.covariances[:, i, columns]),
    }
    return NwbPerson(
        found.people[i],
        points,
        list(dict.fromkeys(bone for model in models for bone in model.bones)),
        found.joints[:, i, columns],
        seen.points_px[:, :, i, columns],
        found.confidence[:, i, columns],
        provenance,
    )
