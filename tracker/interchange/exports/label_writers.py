"""Write labels of each view and frame to folders: points as OpenPose's JSON, masks of parts and people as PNG."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.files import write_text_atomic
from tracker.formats.joint_maps import known_joint_maps
from tracker.formats.keypoints.detections import OpenPosePerson, file_name, write_openpose
from tracker.formats.write_only.indexed_png import write_indexed_png
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions
from tracker.interchange.exports.provenance import point_lost
from tracker.interchange.exports.views import FrameViews, PersonInView, Pictures, exported_cameras, undistorted_pictures

WriteView = Callable[[FrameViews, int, int], None]
"""Writes the labels of a frame in a view: the people, the view, the frame."""


def write_points(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the points of all people in all views as OpenPose's JSON, a file for each picture.

    Raises:
        RecordingError: the footage cannot be read.
    """
    files = OpenPoseFiles(motion, exported_cameras(motion, options), paths[0])
    _write(files, motion, options, paths[0], tick)


def _write(
    labels: "OpenPoseFiles | Masks", motion: ExportedMotion, options: ExportOptions, folder: Path, tick: Tick
) -> None:
    with undistorted_pictures(motion, options, folder) as pictures:
        write_views(motion, exported_cameras(motion, options), pictures, labels.write, tick)


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


SOMEBODY = np.iinfo(np.uint8).max
"""Label of a person whose pose is not exported, as in masks of footage (`tracker.footage.recording.read_mask`)."""
_SOMEBODY_COLOR = "#808080"


def write_masks(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the masks of all frames in all views, and their legend.

    Raises:
        FormatError: there are more people or parts than labels.
        RecordingError: the footage cannot be read.
    """
    _write(Masks(motion, exported_cameras(motion, options), paths[0]), motion, options, paths[0], tick)


class Masks:
    """Writes `people/CAMERA/000012.png` and `parts/CAMERA/000012.png` for frame 12 of a camera's footage."""

    def __init__(self, motion: ExportedMotion, cameras: Sequence[Camera], folder: Path) -> None:
        """Number the labels, make the folders, and write the legend.

        Args:
            motion: what is exported.
            cameras: in the pixels of the masks.
            folder: that gets them.

        Raises:
            FormatError: there are more people or parts than labels.
        """
        self._motion, self._folder, self._cameras = motion, folder, cameras
        self._offsets = [source.offset for source in motion.session.cameras]
        in_scene = sum(
            max((len(b.body.model.parts) for b in ({**p.poses, **p.around}).values()), default=0) for p in motion.people
        )
        rows = {(p.index, part.name): part for p in motion.exported for model in p.models for part in model.parts}
        if max(in_scene, len(rows) + 1) > SOMEBODY:
            expected = f"at most {SOMEBODY - 1} parts of all people together, as masks of 8 bits have labels"
            raise FormatError.mismatch("", expected, max(in_scene, len(rows)), Remedy("fewer_people"))
        self._labels = {key: label for label, key in enumerate(rows, 1)}
        self._part_colors = {self._labels[key]: part.color for key, part in rows.items()} | {SOMEBODY: _SOMEBODY_COLOR}
        self._colors = {p.index + 1: p.person.color for p in motion.exported} | {SOMEBODY: _SOMEBODY_COLOR}
        for kind in ("people", "parts"):
            for camera in cameras:
                (folder / kind / camera.name).mkdir(parents=True)
        self._write_legend()

    def _write_legend(self) -> None:
        """Write the meaning of the labels."""
        names = {p.index: p.person.name for p in self._motion.people}
        common = {"0": "background", str(SOMEBODY): "a person whose pose is not exported"}
        legend = {
            "people": common | {str(p.index + 1): p.person.name for p in self._motion.exported},
            "parts": common
            | {str(label): {"person": names[i], "part": part} for (i, part), label in self._labels.items()},
        }
        write_text_atomic(self._folder / "legend.json", json.dumps(legend, indent=1, ensure_ascii=False) + "\n")

    def write(self, views: FrameViews, view: int, frame: int) -> None:
        """Write the masks of a frame in a view."""
        people, parts = views.labels(view)
        person_labels = np.where(people < 0, 0, SOMEBODY)
        part_labels = person_labels.copy()
        for person in self._motion.exported:
            if not self._motion.is_exported(person, frame):
                continue
            own = people == person.index
            names = [part.name for part in person.poses[frame].body.model.parts]
            label_of_part = np.array([self._labels[person.index, name] for name in names])
            person_labels[own] = person.index + 1
            part_labels[own] = label_of_part[parts[own]]
        name = f"{frame + self._offsets[view]:06d}.png"
        for kind, labels, colors in (
            ("people", person_labels, self._colors),
            ("parts", part_labels, self._part_colors),
        ):
            path = self._folder / kind / self._cameras[view].name / name
            write_indexed_png(path, labels.astype(np.uint8), colors)
