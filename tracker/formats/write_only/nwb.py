"""NWB files with the types of ndx-pose for several cameras: points in space, in each view, skeletons, cameras.

Each person is a `MultiCameraPoseEstimation`, which holds a series for each point and a `PoseEstimation` for each view.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from tracker.formats.file_names import identifier, identifiers
from tracker.formats.write_only.optional_packages import require
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

_CONFIDENCE = "probability that the limb of the point is not lost; 1 where not assessed"


class NwbView(NamedTuple):
    """A camera and its footage."""

    camera: Camera
    """Its pose is in the axes of the points in space."""
    footage: str
    """Path or name of the video or of the folder of images."""
    offset: int
    """Frame k of the session is frame k + offset of the footage."""
    n_frames: int
    """Number of frames of the footage."""


class NwbPerson(NamedTuple):
    """A person with n points on F frames in V views."""

    name: str
    points: Sequence[str]
    """Names of the points."""
    bones: Sequence[tuple[str, str]]
    """Pairs of points that are connected."""
    joints: Array
    """(F, n, 3), metres; NaN where missing."""
    points_px: Array
    """(V, F, n, 2), original pixels; NaN where missing."""
    confidence: Array
    """(F, n), from 0 to 1; NaN without a point."""
    provenance: Mapping[str, tuple[str, NDArray[Any]]]
    """Columns by name: their description and their values, (F, ...)."""


@dataclass(frozen=True, eq=False)
class NwbRecording:
    """A recording with a constant rate."""

    name: str
    frames: range
    """Of the session."""
    fps: float
    space: str
    """The axes of points in space, in words."""
    version: str
    """Of the program."""
    views: Sequence[NwbView]
    people: Sequence[NwbPerson]


def write_nwb(path: Path, recording: NwbRecording) -> None:
    """Write a recording.

    Raises:
        FormatError: a package is missing.
        OSError: the file cannot be written.
    """
    pynwb, pose = require("pynwb", "NWB"), require("ndx_pose", "NWB")
    file = pynwb.NWBFile(
        session_description=f"{recording.name}, exported by Quadrille. The date of the recording is not known.",
        identifier=str(uuid4()),
        session_start_time=datetime.fromtimestamp(0, UTC),  # NWB requires one
        session_id=identifier(recording.name),
        source_script_file_name="quadrille export",
        source_script=f"quadrille {recording.version}",
    )
    behavior = file.create_processing_module("behavior", "poses of people, from several calibrated cameras")
    cameras = identifiers([view.camera.name for view in recording.views])
    devices = [file.add_device(_device(pose, name, v.camera)) for name, v in zip(cameras, recording.views, strict=True)]
    videos = [_video(pynwb, recording, name, v) for name, v in zip(cameras, recording.views, strict=True)]
    for video in videos:
        file.add_acquisition(video)
    names = identifiers(["Skeletons", *(person.name for person in recording.people)])[1:]
    skeletons = [_skeleton(pose, name, person) for name, person in zip(names, recording.people, strict=True)]
    behavior.add(pose.Skeletons(skeletons=skeletons))
    for name, person, skeleton in zip(names, recording.people, skeletons, strict=True):
        common = {
            "scorer": "quadrille", "source_software": "Quadrille", "source_software_version": recording.version,
            "skeleton": skeleton,
        }  # fmt: skip
        in_views = [
            pose.PoseEstimation(
                name=f"{name}_{camera}",
                description="joint centers in the pixels of the footage, with its lens distortion",
                device=device,
                source_video=video,
                pose_estimation_series=_series(pose, recording, person, points_px),
                **common,
            )
            for camera, device, video, points_px in zip(cameras, devices, videos, person.points_px, strict=True)
        ]
        behavior.add(
            pose.MultiCameraPoseEstimation(
                name=name,
                description=f"joint centers of {person.name} in space",
                pose_estimation_series=_series(pose, recording, person, person.joints),
                pose_estimations=in_views,
                **common,
            )
        )
        behavior.add(_table(pynwb, f"{name}_provenance", person))
    with pynwb.NWBHDF5IO(str(path), "w") as writer:
        writer.write(file)


def _device(pose: Any, name: str, camera: Camera) -> Any:
    """Return a camera; its pose maps points in space to it."""
    lens = "equidistant model of a fisheye (cv2.fisheye)" if camera.fisheye else "OpenCV's k1, k2, p1, p2, k3, ..."
    coefficients = camera.distortion if camera.distortion.size else np.zeros(4)
    return pose.CalibratedCamera(
        name=name,
        description=f"camera {camera.name}, {camera.width}x{camera.height} px; distortion: {lens}",
        intrinsic_matrix=camera.K.astype(np.float32),
        rotation_matrix=camera.T_camera_world[:3, :3].astype(np.float32),
        translation_vector=camera.T_camera_world[:3, 3].astype(np.float32),
        distortion_coefficients=coefficients.astype(np.float32),
    )


def _video(pynwb: Any, recording: NwbRecording, name: str, view: NwbView) -> Any:
    """Return the footage of a camera, which stays where it is."""
    return pynwb.image.ImageSeries(
        name=f"{name}_video",
        description=f"frame k of the session is frame k + {view.offset} of the footage",
        external_file=[view.footage],
        starting_frame=[0],
        format="external",
        dimension=list(view.camera.size),
        starting_time=-view.offset / recording.fps,
        rate=recording.fps,
        num_samples=view.n_frames,
        unit="n.a.",
    )


def _skeleton(pose: Any, name: str, person: NwbPerson) -> Any:
    index = {point: i for i, point in enumerate(person.points)}
    edges = np.array([[index[a], index[b]] for a, b in person.bones], np.uint8).reshape(-1, 2)
    return pose.Skeleton(name=f"{name}_skeleton", nodes=identifiers(list(person.points)), edges=edges)


def _series(pose: Any, recording: NwbRecording, person: NwbPerson, points: Array) -> list[Any]:
    """Return the series of all points, (F, n, D), D = 3 in space and 2 in a view."""
    in_space = points.shape[-1] == 3
    known = np.where(np.isnan(points[..., 0]), np.nan, person.confidence)
    return [
        pose.PoseEstimationSeries(
            name=name,
            data=points[:, i].astype(np.float32),
            unit="meters" if in_space else "pixels",
            reference_frame=recording.space if in_space else "the center of the upper left pixel; x right, y down",
            confidence=known[:, i].astype(np.float32),
            confidence_definition=_CONFIDENCE,
            starting_time=recording.frames.start / recording.fps,
            rate=recording.fps,
        )
        for i, name in enumerate(identifiers(list(person.points)))
    ]


def _table(pynwb: Any, name: str, person: NwbPerson) -> Any:
    """Return the provenance of a person's poses, one row for each frame."""
    columns = [
        pynwb.core.VectorData(name=column, description=description, data=values)
        for column, (description, values) in person.provenance.items()
    ]
    return pynwb.core.DynamicTable(name=name, description=f"provenance of the poses of {person.name}", columns=columns)
