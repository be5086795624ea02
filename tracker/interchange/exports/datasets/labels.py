"""Labels of the recordings of a dataset, with numbers of images, annotations and people that are unique over all."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import msgspec

from tracker.errors import FormatError
from tracker.formats.keypoints.coco import CocoAnnotation, CocoCategory, CocoImage, segmentation, write_coco
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.datasets.card import TO_FILL_IN, LabelCounts
from tracker.interchange.exports.frame_views import FrameViews
from tracker.interchange.exports.label_writers import OpenPoseFiles
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions
from tracker.interchange.exports.views import IMAGES
from tracker.interchange.exports.writers import coco_annotations, coco_categories


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
