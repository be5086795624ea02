"""The card of a dataset: what is in it, how it came about, and what its owner has to add."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from importlib import resources
from typing import NamedTuple

import numpy as np

from tracker.compute.installed_package import program_version
from tracker.geometry.arrays import Array
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, frames_text
from tracker.interchange.exports.provenance import PoseProvenance, pose_provenance

TO_FILL_IN = "TO BE FILLED IN"
"""Value of a field that only the owner knows."""
_FACES = {
    "shown": "as filmed",
    "blurred": "heads are blurred where a pose, key points or a mask show them; look at the pictures all the same",
}
"""Sentences on the faces in the pictures."""
_VALUES = {
    "status: {}": ("status", "not assessed"),
    "source: {}": ("source", ""),
    "annotator: {}": ("annotator", "not named"),
    "verified by: {}": ("verified_by", ""),
    "body: revision {}": ("body_revision", ""),
}
"""Properties of poses that are counted by value: the field of the provenance, and the word for an empty one."""
_FLAGS = {"keyframes": "keyframe", "reviewed": "reviewed", "of an earlier calibration": "earlier_calibration"}
"""Properties that poses have or not."""
_TEMPLATE = resources.files("tracker").joinpath("interchange", "exports", "datasets", "card.md")


class LabelCounts(NamedTuple):
    """Numbers of labels."""

    images: int = 0
    annotations: int = 0
    labelled: int = 0
    """People who are visible in an image and labelled, over all images."""
    unlabelled: int = 0
    """People who are visible in an image without a label, over all images: their poses are not exported."""

    def plus(self, other: "LabelCounts") -> "LabelCounts":
        """Return the numbers of two sets of labels."""
        return LabelCounts(*(a + b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True, eq=False)
class RecordingSummary:
    """Content of a dataset that comes from one recording."""

    name: str
    """Of its folder."""
    session: str
    """Name of the session."""
    people: Mapping[str, int]
    """Number in the dataset of each person with a pose, by name."""
    n_cameras: int
    frames: str
    """The exported frames, as text."""
    n_frames: int
    n_session_frames: int
    fps: float
    labels: LabelCounts
    n_poses: int
    """Number of poses in space."""
    n_missing: int
    """Number of frames without a pose, over its people."""
    provenance: Counter[tuple[str, str]]
    """Number of poses by what is known of them: a property and its value."""
    errors_m: Array
    """Expected errors of the joints of poses that have some, (n,), metres."""
    n_with_errors: int
    """Number of poses that have expected errors."""


def summarize(name: str, motion: ExportedMotion, people: Mapping[str, int], labels: LabelCounts) -> RecordingSummary:
    """Summarize a recording.

    Args:
        name: of its folder.
        motion: of the recording.
        people: number in the dataset of each person with a pose.
        labels: numbers of its labels.
    """
    session = motion.session
    found = [pose_provenance(motion, p, f) for p in motion.exported for f in sorted(p.poses)]
    errors = [np.sqrt(np.trace(p.record.errors, axis1=1, axis2=2)) for p in found if p.record.errors is not None]
    return RecordingSummary(
        name, session.name, people, len(session.cameras), frames_text(motion.frames), len(motion.frames),
        session.n_frames, session.fps, labels, len(found), motion.n_missing, _provenance_counts(found),
        np.concatenate(errors) if errors else np.zeros(0), len(errors),
    )  # fmt: skip


def shared_people(summaries: Sequence[RecordingSummary]) -> list[tuple[str, list[str]]]:
    """Return the name of each person who is in several recordings, and these."""
    recordings: dict[tuple[str, int], list[str]] = {}
    for s in summaries:
        for name, number in s.people.items():
            recordings.setdefault((name, number), []).append(s.name)
    return [(name, found) for (name, _), found in recordings.items() if len(found) > 1]


def format_card(
    summaries: Sequence[RecordingSummary], splits: Mapping[str, Sequence[str]], choice: str, options: ExportOptions
) -> str:
    """Return the card as Markdown.

    Args:
        summaries: of all recordings.
        splits: the recordings of each split.
        choice: a sentence on how they were divided.
        options: of the export.
    """
    lens = "without lens distortion" if options.pixels == "undistorted" else "of the footage, with its lens distortion"
    rows = [(split, str(len(names)), ", ".join(names)) for split, names in splits.items()]
    return _TEMPLATE.read_text("utf-8").format(
        sessions=", ".join(dict.fromkeys(s.session for s in summaries)),
        to_fill_in=TO_FILL_IN,
        counts=_table(("what", "number"), _count_rows(summaries)),
        recordings=_of_recordings(summaries, splits),
        provenance=_table(("what", "poses"), _provenance_rows(summaries)),
        version=program_version(),
        frames="; ".join(f"frames {s.frames} of {s.session}" for s in summaries),
        pictures={"images": "images", "video": "videos, whole"}[options.pictures],
        lens=lens,
        faces=_FACES[options.faces],
        splits=_table(("split", "recordings", "names"), rows),
        choice=choice,
    )


def _count_rows(summaries: Sequence[RecordingSummary]) -> list[tuple[str, str]]:
    labels = reduce(LabelCounts.plus, (s.labels for s in summaries), LabelCounts())
    rates = ", ".join(dict.fromkeys(f"{s.fps:g}" for s in summaries))
    n_frames, n_all = sum(s.n_frames for s in summaries), sum(s.n_session_frames for s in summaries)
    return [
        ("recordings", str(len(summaries))),
        ("people", str(len({number for s in summaries for number in s.people.values()}))),
        ("cameras", ", ".join(dict.fromkeys(str(s.n_cameras) for s in summaries))),
        ("frames", f"{n_frames} of {n_all}, at {rates} per second"),
        ("labelled pictures", str(labels.images)),
        ("annotations (COCO)", str(labels.annotations)),
        ("people visible in a picture with a label", str(labels.labelled)),
        ("people visible in a picture without a label", str(labels.unlabelled)),
        ("poses in space", str(sum(s.n_poses for s in summaries))),
    ]


def _of_recordings(summaries: Sequence[RecordingSummary], splits: Mapping[str, Sequence[str]]) -> str:
    """Return a table of the recordings and one of the people who are in several; nothing for one recording."""
    if len(summaries) == 1:
        return ""
    split_of = {name: split for split, names in splits.items() for name in names}
    head = ("recording", "session", "split", "people", "cameras", "frames", "pictures", "poses")
    rows = [
        (
            s.name, s.session, split_of[s.name], ", ".join(s.people), str(s.n_cameras), str(s.n_frames),
            str(s.labels.images), str(s.n_poses),
        )
        for s in summaries
    ]  # fmt: skip
    people = "None: each person has a `track_id` of their own in each recording."
    if shared := shared_people(summaries):
        of_person = [
            (name, ", ".join(found), ", ".join(dict.fromkeys(split_of[r] for r in found))) for name, found in shared
        ]
        text = "People of one name count as one person, and have one `track_id`."
        people = f"{text}\n\n{_table(('person', 'recordings', 'splits'), of_person)}"
    return f"## Recordings\n\n{_table(head, rows)}\n\n## People in several recordings\n\n{people}\n\n"


def _provenance_counts(found: list[PoseProvenance]) -> Counter[tuple[str, str]]:
    """Return the numbers of poses by what is known of them."""
    counts: Counter[tuple[str, str]] = Counter()
    for of_pose in (p.fields for p in found):
        counts.update((what, str(of_pose[field] or empty)) for what, (field, empty) in _VALUES.items())
        counts.update((what, "") for what, field in _FLAGS.items() if of_pose[field])
    return counts


def _provenance_rows(summaries: Sequence[RecordingSummary]) -> list[tuple[str, str]]:
    """Return the numbers of poses by what is known of them, in all recordings."""
    counts: Counter[tuple[str, str]] = Counter()
    for s in summaries:
        counts.update(s.provenance)
    rows = [
        (what.format(value), str(n))
        for of_kind in _VALUES
        for (what, value), n in counts.most_common()
        if what == of_kind and value
    ]
    rows += [(what, str(counts[what, ""])) for what in _FLAGS]
    if n := sum(s.n_with_errors for s in summaries):
        error_mm = 1000 * float(np.median(np.concatenate([s.errors_m for s in summaries])))
        rows.append(("with expected errors", f"{n}, median {error_mm:.0f} mm for each joint"))
    return rows


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """Return a table of Markdown."""
    return "\n".join(
        f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
        for row in (head, ("---",) * len(head), *rows)
    )
