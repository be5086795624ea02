"""The card of a dataset: what is in it, how it came about, and what its owner has to add."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tracker.exports.motion import ExportedMotion, frames_text
from tracker.exports.options import ExportOptions
from tracker.exports.provenance import PoseProvenance, pose_provenance
from tracker.store.edit_tree import program_version

TO_FILL_IN = "TO BE FILLED IN"
"""Value of a field that only the owner knows."""
_OWNER_FIELDS = {
    "Licence": "terms under which the pictures and labels may be used",
    "Rights holder and contact": "who may be asked, and where",
    "Consent of the people filmed": "whether each has agreed to this use, in which form, and until when",
    "Ethics approval": "board and number, or why none is needed",
    "Date and place of the recording": "as far as they may be told",
    "People filmed": "how they were chosen; age, sex, body and clothing as far as they may be told",
    "Intended use": "what the dataset is for, and what it must not be used for",
}
"""Fields that the owner fills in, with their meaning."""


class LabelCounts(NamedTuple):
    """Numbers of labels."""

    images: int
    annotations: int
    labelled: int
    """People who are visible in an image and labelled, over all images."""
    unlabelled: int
    """People who are visible in an image without a label, over all images: their poses are not exported."""


def format_card(motion: ExportedMotion, options: ExportOptions, counts: LabelCounts) -> str:
    """Return the card as Markdown."""
    session = motion.session
    found = [pose_provenance(motion, p, f) for p in motion.exported for f in sorted(p.poses)]
    where = {"images": "recordings/*/images", "video": "recordings/*/videos, whole"}[options.pictures]
    lines = [
        f"# {session.name}",
        "",
        "A dataset of people filmed by calibrated cameras, with labels by Quadrille.",
        "",
        "## To be filled in by the owner",
        "",
        *_table(("field", "value", "meaning"), [(f, TO_FILL_IN, m) for f, m in _OWNER_FIELDS.items()]),
        "",
        "## Counts",
        "",
        *_table(
            ("what", "number"),
            [
                ("recordings", "1"),
                ("people", str(len(motion.exported))),
                ("cameras", str(len(session.cameras))),
                ("frames", f"{len(motion.frames)} of {session.n_frames}, at {session.fps:g} per second"),
                ("labelled pictures", str(counts.images)),
                ("annotations (COCO)", str(counts.annotations)),
                ("people visible in a picture with a label", str(counts.labelled)),
                ("people visible in a picture without a label", str(counts.unlabelled)),
                ("poses in space", str(len(found))),
            ],
        ),
        "",
        "## Provenance",
        "",
        *_table(("what", "poses"), _provenance_rows(found)),
        "",
        f"Frames {frames_text(motion.frames)} of the session were exported by Quadrille {program_version()}. "
        "`provenance.json` has the provenance of each pose and joint.",
        "",
        "## Files",
        "",
        *_table(("file", "content"), [(f"`{name}`", text) for name, text in _files(where, options).items()]),
        "",
        "## Splits",
        "",
        "`splits.json` lists recordings. Move whole recordings from one split to another: frames of one recording are "
        "too alike to train on some and test on others.",
        "",
    ]
    return "\n".join(lines)


def _provenance_rows(found: list[PoseProvenance]) -> list[tuple[str, str]]:
    """Return the numbers of poses by what is known of them."""
    rows: list[tuple[str, str]] = []
    for what, values in (
        ("status", [p.record.status or "not assessed" for p in found]),
        ("source", [p.source for p in found]),
        ("annotator", [p.record.author or "not named" for p in found]),
        ("verified by", [p.verified_by for p in found if p.verified_by]),
        ("body", [f"revision {p.record.model_revision}" for p in found]),
    ):
        rows += [(f"{what}: {value}", str(n)) for value, n in Counter(values).most_common()]
    rows.append(("keyframes", str(sum(p.record.keyframe for p in found))))
    rows.append(("reviewed", str(sum(p.is_reviewed for p in found))))
    rows.append(("of an earlier calibration", str(sum(p.is_earlier_calibration for p in found))))
    errors = [np.sqrt(np.trace(p.record.errors, axis1=1, axis2=2)) for p in found if p.record.errors is not None]
    if errors:
        error_mm = 1000 * float(np.median(np.concatenate(errors)))
        rows.append(("with expected errors", f"{len(errors)}, median {error_mm:.0f} mm for each joint"))
    return rows


def _files(where: str, options: ExportOptions) -> Mapping[str, str]:
    lens = "without lens distortion" if options.pixels == "undistorted" else "of the footage, with its lens distortion"
    return {
        where: f"pictures, numbered as frames of the footage; pixels {lens}",
        "recordings/*/labels/coco.json": "keypoints and segmentation (COCO)",
        "recordings/*/labels/openpose": "keypoints (BODY_25)",
        "recordings/*/calibration": "cameras in the layouts of anipose and of OpenCV, in metres",
        "recordings/*/poses.npz": "poses, joint centers and covariances in space",
        "SHA256SUMS": "checksums; check them by `sha256sum -c SHA256SUMS`",
    }


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return the lines of a table."""
    return [
        f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
        for row in (head, ("---",) * len(head), *rows)
    ]
