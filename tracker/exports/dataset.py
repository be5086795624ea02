"""Write a folder to train and test on: pictures, labels, calibration, poses, a card, and checksums.

README.md                   the card
splits.json                 recordings of training, validation and test
provenance.json             of each pose
SHA256SUMS
recordings/NAME/
  images/CAMERA/000012.jpg  picture 12 of the footage; or videos/CAMERA.mp4, the footage as it is
  labels/coco.json          keypoints and segmentation
  labels/openpose/CAMERA_json/CAMERA_000000000012_keypoints.json
  calibration/anipose.toml, opencv.yml
  poses.npz                 poses, joint centres and covariances in space
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import msgspec

from tracker.calibrations.writing import write_layout
from tracker.errors import FormatError, Remedy
from tracker.exports.array_writers import write_npz
from tracker.exports.dataset_card import TO_FILL_IN, LabelCounts, format_card
from tracker.exports.frame_views import FrameViews
from tracker.exports.label_writers import OpenPoseFiles, write_views
from tracker.exports.motion import ExportedMotion
from tracker.exports.options import ExportOptions
from tracker.exports.provenance import write_provenance
from tracker.exports.views import IMAGES, Pictures, exported_cameras
from tracker.exports.writers import coco_annotations, coco_categories
from tracker.files import write_text_atomic
from tracker.formats.file_names import identifier
from tracker.formats.keypoints.coco import CocoAnnotation, CocoImage, segmentation, write_coco
from tracker.geometry.cameras import Camera

CHECKSUMS = "SHA256SUMS"
"""Name of the file that `sha256sum -c` reads."""
SUFFIXES = {"anipose": ".toml", "opencv": ".yml"}
"""Layouts of the calibration, with the ends of their files' names."""


def write_dataset(
    motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Callable[[], None]
) -> None:
    """Write a dataset of one recording.

    Raises:
        FormatError: videos are wanted in undistorted pixels.
        RecordingError: the footage cannot be read.
    """
    if options.pictures == "video" and options.pixels == "undistorted":
        raise FormatError(
            "expected images with undistorted pixels, found video: footage is copied as it is", Remedy("export_images")
        )
    folder, cameras, name = paths[0], exported_cameras(motion, options), identifier(motion.session.folder.name)
    recording = folder / "recordings" / name
    labels = _Labels(motion, options, cameras, recording / "labels")
    with ExitStack() as stack:
        pictures = None
        if options.pictures == "images":
            pictures = stack.enter_context(Pictures(motion, cameras, recording))
        else:
            _copy_footage(motion, recording / "videos")
        write_views(motion, cameras, pictures, labels.write, tick)
    labels.finish()
    (recording / "calibration").mkdir()
    for layout, suffix in SUFFIXES.items():
        write_layout(recording / "calibration" / f"{layout}{suffix}", layout, cameras)
    write_npz(motion, options, [recording / "poses.npz"], lambda: None)
    splits = {"train": [name], "validation": [], "test": []}
    write_text_atomic(folder / "splits.json", json.dumps(splits, indent=1) + "\n")
    write_provenance(folder / "provenance.json", motion, options)
    card = format_card(motion, options, labels.counts)
    write_text_atomic(folder / "README.md", card)
    _write_checksums(folder)


class _Labels:
    """Writes the labels of a recording."""

    def __init__(self, motion: ExportedMotion, options: ExportOptions, cameras: Sequence[Camera], folder: Path) -> None:
        self._motion, self._cameras, self._folder = motion, cameras, folder
        self._openpose = OpenPoseFiles(motion, cameras, folder / "openpose")
        self._categories = coco_categories(motion, options)
        self._images: list[CocoImage] = []
        self._annotations: list[CocoAnnotation] = []
        self._n_labelled = self._n_unlabelled = 0

    def write(self, views: FrameViews, view: int, frame: int) -> None:
        """Write the labels of a frame in a view."""
        self._openpose.write(views, view, frame)
        source, camera = self._motion.session.cameras[view], self._cameras[view]
        at = frame + source.offset
        path = f"{IMAGES}/{camera.name}/{at:06d}.jpg"
        image = CocoImage(len(self._images) + 1, path, *camera.size, camera.name, frame, source.footage.name, at)
        self._images.append(image)
        people, _ = views.labels(view)
        seen = views.seen(view)
        shown = {int(i) for i in set(people[people >= 0].tolist())}
        for person, body, keypoints in seen:
            if person.index not in shown:
                continue
            mask = people == person.index
            rows, columns = mask.any(axis=1).nonzero()[0], mask.any(axis=0).nonzero()[0]
            left, top = int(columns[0]), int(rows[0])
            box = (left, top, int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top)
            n = len(self._annotations)
            visible = {"segmentation": segmentation(mask), "bbox": box, "area": float(mask.sum())}
            for one in coco_annotations(self._motion, self._categories, person, body, keypoints, image, n):
                self._annotations.append(msgspec.structs.replace(one, **visible))
        labelled = shown & {person.index for person, _, _ in seen}
        self._n_labelled += len(labelled)
        self._n_unlabelled += len(shown - labelled)

    @property
    def counts(self) -> LabelCounts:
        """Return how much is labelled."""
        return LabelCounts(len(self._images), len(self._annotations), self._n_labelled, self._n_unlabelled)

    def finish(self) -> None:
        """Write the labels of all pictures."""
        name = f"{self._motion.session.name}, exported by Quadrille; licence: {TO_FILL_IN}"
        revision = self._motion.calibrations.present
        write_coco(self._folder / "coco.json", name, revision, self._categories, self._images, self._annotations)


def _copy_footage(motion: ExportedMotion, folder: Path) -> None:
    """Copy the footage of all cameras: a video as `CAMERA.mp4`, images of a folder to `CAMERA`."""
    folder.mkdir(parents=True)
    for source in motion.session.cameras:
        if source.footage.is_dir():
            shutil.copytree(source.footage, folder / source.camera.name)
        else:
            shutil.copyfile(source.footage, folder / f"{source.camera.name}{source.footage.suffix}")


def _write_checksums(folder: Path) -> None:
    """Write the SHA-256 of all files, as `sha256sum` does."""
    lines = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        with path.open("rb") as file:
            lines.append(f"{hashlib.file_digest(file, 'sha256').hexdigest()}  {path.relative_to(folder).as_posix()}\n")
    write_text_atomic(folder / CHECKSUMS, "".join(lines))
