"""Write masks of parts and people in each view: indexed PNG, and a legend of their labels."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.files import write_text_atomic
from tracker.formats.write_only.indexed_png import write_indexed_png
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.export_format import Tick
from tracker.interchange.exports.frame_views import FrameViews
from tracker.interchange.exports.label_writers import write_views
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions
from tracker.interchange.exports.views import exported_cameras, undistorted_pictures

SOMEBODY = np.iinfo(np.uint8).max
"""Label of a person whose pose is not exported, as in masks of footage (`tracker.footage.recording.read_mask`)."""
_SOMEBODY_COLOR = "#808080"


def write_masks(motion: ExportedMotion, options: ExportOptions, paths: Sequence[Path], tick: Tick) -> None:
    """Write the masks of all frames in all views, and their legend.

    Raises:
        FormatError: there are more people or parts than labels.
        RecordingError: the footage cannot be read.
    """
    cameras = exported_cameras(motion, options)
    masks = Masks(motion, cameras, paths[0])
    with undistorted_pictures(motion, options, paths[0]) as pictures:
        write_views(motion, cameras, pictures, masks.write, tick)


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
            raise FormatError(
                f"expected at most {SOMEBODY - 1} parts of all people together, as masks of 8 bits have labels, found "
                f"{max(in_scene, len(rows))}",
                Remedy("fewer_people"),
            )
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
