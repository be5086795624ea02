"""Write labels of each view and frame to folders: points as OpenPose's JSON, masks of parts and people."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tracker.formats.joint_maps import known_joint_maps
from tracker.formats.keypoints.openpose import OpenPosePerson, file_name, write_openpose
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.export_format import Tick
from tracker.interchange.exports.frame_views import FrameViews, PersonInView
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions
from tracker.interchange.exports.provenance import point_lost
from tracker.interchange.exports.views import Pictures, exported_cameras, undistorted_pictures

WriteView = Callable[[FrameViews, int, int], None]
"""Writes the labels of a frame in a view: the people, the view, the frame."""


def write_points(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of all people in all views as OpenPose's JSON, a file for each picture.

    Raises:
        RecordingError: the footage cannot be read.
    """
    cameras = exported_cameras(motion, options)
    files = OpenPoseFiles(motion, cameras, paths[0])
    with undistorted_pictures(motion, options, paths[0]) as pictures:
        write_views(motion, cameras, pictures, files.write, tick)


def write_views(
    motion: ExportedMotion, cameras: Sequence[Camera], pictures: Pictures | None, write: WriteView, tick: Tick
) -> None:
    """Write the labels of all frames in all views, and their pictures if they are wanted.

    Args:
        motion: what is exported.
        cameras: in the pixels of the labels.
        pictures: writes a picture; that of a damaged frame is left out with its labels.
        write: writes the labels of a frame in a view.
        tick: called after each frame.

    Raises:
        RecordingError: the footage cannot be read.
    """
    for frame in motion.frames:
        views = FrameViews(motion, cameras, frame)
        for view in range(len(cameras)):
            if pictures is None or pictures.write(view, frame):
                write(views, view, frame)
        tick()


class OpenPoseFiles:
    """Writes `CAMERA_json/CAMERA_000000000012_keypoints.json` for picture 12 of a camera's footage."""

    def __init__(self, motion: ExportedMotion, cameras: Sequence[Camera], folder: Path) -> None:
        """Make a folder for each camera.

        Args:
            motion: what is exported.
            cameras: in the pixels of the points.
            folder: that gets them.
        """
        self._cameras, self._offsets = cameras, [source.offset for source in motion.session.cameras]
        self._folders = [folder / f"{camera.name}_json" for camera in cameras]
        for one in self._folders:
            one.mkdir(parents=True)

    def write(self, views: FrameViews, view: int, frame: int) -> None:
        """Write the points of a frame in a view."""
        camera = self._cameras[view]
        people = [_openpose_person(seen, camera, frame) for seen in views.seen(view)]
        write_openpose(self._folders[view] / file_name(camera.name, frame + self._offsets[view]), people)


def _openpose_person(seen: PersonInView, camera: Camera, frame: int) -> OpenPosePerson:
    """Return a person's points in the order of BODY_25.

    A mean of points is that in space, as visible as the best one.
    """
    skeleton = next(known for known in known_joint_maps() if known.name == "BODY_25")
    counterparts = skeleton.counterparts(skeleton.points)
    model, keypoints = seen.body.model, seen.keypoints
    found = 1.0 - np.nan_to_num(point_lost(model, seen.person.poses[frame].record.limbs_lost))
    points_px, confidence = np.full((len(counterparts), 2), np.nan), np.zeros(len(counterparts))
    visibility = np.zeros(len(counterparts), np.int64)
    for i, own in enumerate(counterparts.values()):
        if not own or not set(own) <= set(model.point_names):
            continue
        at = [model.point_names.index(one) for one in own]
        points_px[i] = keypoints.points_px[at[0]]
        if len(at) > 1:
            points_px[i] = project_through_lens(camera, seen.body.joint_centers_world[at].mean(axis=0)[None])[0]
        confidence[i], visibility[i] = found[at].min(), keypoints.visibility[at].max()
    return OpenPosePerson(seen.person.index, points_px, confidence, visibility)
