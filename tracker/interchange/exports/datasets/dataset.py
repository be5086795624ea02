"""Write a folder to train and test on: pictures, labels, calibration, poses, a card, and checksums.

README.md                   the card
splits.json                 recordings of training, validation and test
provenance.json             names the file of each recording
SHA256SUMS
recordings/NAME/
  images/CAMERA/000012.jpg  picture 12 of the footage; or videos/CAMERA.mp4, the footage as it is
  labels/coco.json          keypoints and segmentation
  labels/openpose/CAMERA_json/CAMERA_000000000012_keypoints.json
  calibration/anipose.toml, opencv.yml
  poses.npz                 poses, joint centres and covariances in space
  provenance.json           of each pose
"""

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import NamedTuple

import msgspec

from tracker.compute.installed_package import program_version
from tracker.errors import FormatError, Remedy
from tracker.files import write_text_atomic
from tracker.formats.calibrations.writing import write_layout
from tracker.formats.file_names import identifier
from tracker.formats.keypoints.coco import CocoAnnotation, CocoCategory, CocoImage, segmentation, write_coco
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.datasets.card import TO_FILL_IN, LabelCounts, RecordingSummary, format_card, summarize
from tracker.interchange.exports.datasets.splits import SplitChoice, divide
from tracker.interchange.exports.export_files import FOLDER_PROVENANCE, is_export_folder, moved_at_end, unwritable
from tracker.interchange.exports.formats import Tick
from tracker.interchange.exports.label_writers import OpenPoseFiles, write_views
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions
from tracker.interchange.exports.provenance import write_provenance
from tracker.interchange.exports.views import IMAGES, FrameViews, Pictures, exported_cameras
from tracker.interchange.exports.writers import coco_annotations, coco_categories, write_npz


class DatasetRecording(NamedTuple):
    """A recording of a dataset."""

    name: str
    """Of its folder."""
    read: Callable[[], ExportedMotion]
    """Reads its poses; called more than once, so that those of one recording at a time are in memory."""


@dataclass(frozen=True)
class DatasetLabels:
    """Everything that the labels of all recordings share."""

    categories: Sequence[CocoCategory]
    """Sets of keypoints."""
    people: Mapping[tuple[str, str], int]
    """Number of each person in the dataset, from 0, by recording and name."""
    n_frames: int
    """Number of exported frames."""


def plan_labels(
    recordings: Sequence[DatasetRecording], options: ExportOptions, distinct_people: bool = False
) -> DatasetLabels:
    """Return the categories and people of all recordings.

    Args:
        recordings: of the dataset; each is read once.
        options: of the export.
        distinct_people: whether people of one name in two recordings are two people.

    Raises:
        FormatError: bodies of one name have different points.
        SessionError: nobody has a pose that is exported.
    """
    categories: dict[str, CocoCategory] = {}
    people: dict[tuple[str, str], int] = {}
    identities: dict[tuple[str, str], int] = {}
    n_frames = 0
    for recording in recordings:
        motion = recording.read()
        n_frames += len(motion.frames)
        for one in coco_categories(motion, options):
            known = categories.setdefault(one.name, msgspec.structs.replace(one, id=len(categories) + 1))
            if known.keypoints != one.keypoints:
                raise FormatError(
                    f"expected bodies named '{one.name}' with the same points in all recordings, found other points in "
                    f"'{recording.name}'; rename the body, or export this recording alone"
                )
        for person in motion.people:
            name = person.person.name
            identity = (recording.name if distinct_people else "", name)
            people[recording.name, name] = identities.setdefault(identity, len(identities))
    return DatasetLabels(list(categories.values()), people, n_frames)


class RecordingLabels:
    """Writes the labels of a recording."""

    def __init__(
        self, name: str, motion: ExportedMotion, cameras: Sequence[Camera], folder: Path, of_all: DatasetLabels,
        before: LabelCounts,
    ) -> None:  # fmt: skip
        """Make the folders.

        Args:
            name: of the recording.
            motion: of the recording.
            cameras: in the pixels of the labels.
            folder: that gets the labels.
            of_all: what the labels of all recordings share.
            before: numbers of labels of the recordings before.
        """
        self._name, self._motion, self._cameras, self._folder = name, motion, cameras, folder
        self._openpose = OpenPoseFiles(motion, cameras, folder / "openpose")
        self._of_all, self._before = of_all, before
        self._images: list[CocoImage] = []
        self._annotations: list[CocoAnnotation] = []
        self._n_labelled = self._n_unlabelled = 0

    def write(self, views: FrameViews, view: int, frame: int) -> None:
        """Write the labels of a frame in a view."""
        self._openpose.write(views, view, frame)
        source, camera = self._motion.session.cameras[view], self._cameras[view]
        at = frame + source.offset
        path = f"{IMAGES}/{camera.name}/{at:06d}.jpg"
        number = self._before.images + len(self._images) + 1
        image = CocoImage(number, path, *camera.size, camera.name, frame, source.footage.name, at)
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
            n = self._before.annotations + len(self._annotations)
            own = {"segmentation": segmentation(mask), "bbox": box, "area": float(mask.sum())}
            own["track_id"] = self._of_all.people[self._name, person.person.name]
            for one in coco_annotations(self._motion, self._of_all.categories, person, body, keypoints, image, n):
                self._annotations.append(msgspec.structs.replace(one, **own))
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
        write_coco(self._folder / "coco.json", name, revision, self._of_all.categories, self._images, self._annotations)


CHECKSUMS = "SHA256SUMS"
"""Name of the file that `sha256sum -c` reads."""
SUFFIXES = {"anipose": ".toml", "opencv": ".yml"}
"""Layouts of the calibration, with the ends of their files' names."""


@dataclass(frozen=True)
class DatasetPlan:
    """A dataset of several recordings that can be written: each has poses, and a split."""

    recordings: Sequence[DatasetRecording]
    labels: DatasetLabels
    splits: dict[str, list[str]]
    """The recordings of each split."""
    choice: SplitChoice


def plan_dataset(
    recordings: Sequence[DatasetRecording], options: ExportOptions, choice: SplitChoice, distinct_people: bool = False
) -> DatasetPlan:
    """Divide recordings, and read each once to see that it can be exported.

    Args:
        recordings: of different names.
        options: of the export.
        choice: how they are divided.
        distinct_people: whether people of one name in two recordings are two people.

    Raises:
        FormatError: the choice names another recording, the options exclude each other, or bodies of one name differ.
        SessionError: a session has no poses that are exported.
    """
    _check(options)
    splits = {str(split): names for split, names in divide([r.name for r in recordings], choice).items()}
    return DatasetPlan(recordings, plan_labels(recordings, options, distinct_people), splits, choice)


def export_dataset(
    plan: DatasetPlan, options: ExportOptions, out: Path, overwrite: bool = False, tick: Tick = lambda: None
) -> list[RecordingSummary]:
    """Write a dataset; the folder appears complete or not at all.

    Args:
        plan: what to write.
        options: of the export.
        out: the folder.
        overwrite: whether to replace a folder that an export has made.
        tick: called `plan.labels.n_frames` times; it may raise to stop the export, which leaves nothing behind.

    Returns:
        A summary of each recording.

    Raises:
        TrackerError: the folder exists or cannot be written, or footage cannot be read.
    """
    try:
        with moved_at_end([out], overwrite, is_export_folder) as folder:
            return _write(folder / out.name, plan, options, tick)
    except OSError as error:
        raise unwritable(out, error) from error


def write_dataset(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write a dataset of one recording.

    Raises:
        FormatError: videos are wanted in undistorted pixels.
        RecordingError: the footage cannot be read.
    """
    recordings = [DatasetRecording(identifier(motion.session.folder.name), lambda: motion)]
    _write(paths[0], plan_dataset(recordings, options, SplitChoice()), options, tick)


def _check(options: ExportOptions) -> None:
    kinds = {"undistorted pixels": options.pixels == "undistorted", "blurred faces": options.faces == "blurred"}
    if options.pictures == "video" and any(kinds.values()):
        kind = next(kind for kind, is_wanted in kinds.items() if is_wanted)
        found = "video: footage is copied as it is"
        raise FormatError.mismatch("", f"images with {kind}", found, Remedy("export_images"))


def _write(folder: Path, plan: DatasetPlan, options: ExportOptions, tick: Tick) -> list[RecordingSummary]:
    """Write all recordings and what is about them."""
    summaries: list[RecordingSummary] = []
    for recording in plan.recordings:
        before = reduce(LabelCounts.plus, (s.labels for s in summaries), LabelCounts())
        summaries.append(_write_recording(folder / "recordings", recording, plan.labels, before, options, tick))
    write_text_atomic(folder / "splits.json", json.dumps(plan.splits, indent=1) + "\n")
    own = {recording.name: f"recordings/{recording.name}/{FOLDER_PROVENANCE}" for recording in plan.recordings}
    provenance = {
        "content": "recordings of a dataset exported by Quadrille, with the provenance of their poses",
        "version": 1,
        "program": program_version(),
        "recordings": own,
    }
    write_text_atomic(folder / FOLDER_PROVENANCE, json.dumps(provenance, indent=1) + "\n")
    write_text_atomic(folder / "README.md", format_card(summaries, plan.splits, plan.choice.sentence, options))
    _write_checksums(folder)
    return summaries


def _write_recording(
    recordings: Path, recording: DatasetRecording, of_all: DatasetLabels, before: LabelCounts, options: ExportOptions,
    tick: Tick,
) -> RecordingSummary:  # fmt: skip
    """Write the folder of a recording."""
    motion, folder = recording.read(), recordings / recording.name
    cameras = exported_cameras(motion, options)
    labels = RecordingLabels(recording.name, motion, cameras, folder / "labels", of_all, before)
    with ExitStack() as stack:
        pictures = None
        if options.pictures == "images":
            pictures = stack.enter_context(closing(Pictures(motion, options, cameras, folder)))
        else:
            _copy_footage(motion, folder / "videos")
        write_views(motion, cameras, pictures, labels.write, tick)
    labels.finish()
    (folder / "calibration").mkdir()
    for layout, suffix in SUFFIXES.items():
        write_layout(folder / "calibration" / f"{layout}{suffix}", layout, cameras)
    write_npz(motion, options, [folder / "poses.npz"], lambda: None)
    write_provenance(folder / FOLDER_PROVENANCE, motion, options)
    people = {p.person.name: of_all.people[recording.name, p.person.name] for p in motion.exported}
    return summarize(recording.name, motion, people, labels.counts)


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
