"""The records that the store of annotations reads and writes: poses with their provenance, pins, edits.

All copies of a store share the identities of edits, tasks and comments. New rows get a random one. Edits of a store of
version 9 or older get one that follows from the row, so that two copies that were upgraded apart agree about the edits
that they had in common.
"""

import secrets
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Annotated, Any, NamedTuple, TypeAlias

from msgspec import Meta

from tracker.body.limbs import Search
from tracker.geometry.arrays import Array
from tracker.validation import Time

RowId: TypeAlias = Annotated[int, Meta(ge=1, description="the number of a row")]
ALL_FRAMES = range(1 << 31)
"""More frames than a recording can have."""

SOURCES = ("manual", "pinned", "searched", "fitted", "tracked", "interpolated", "smoothed", "imported")
"""Sources of a value, most manual first. Stored by index: add at the end, never reorder."""
SEEN = "seen"
"""Key of a pose's settings: where a user put points by hand, `{point: {camera: [u, v]}}`, original pixels."""
BETWEEN, SEAM = "between", "seam_mm"
"""Keys of a pose's settings: the two frames that it was interpolated or tracked between, `[first, last]`, which are
keyframes or starts of stretches, and how far the passes from them lie apart, the largest of the limb joints, mm."""
TAKEN_FROM = "taken_from"
"""Key of a pose's settings: words for where a person took it from: the name of a copy of the session, or a mean."""
STATUSES = ("", "good", "doubtful", "lost")
"""Quality of a pose as assessed by its tracker; empty if not assessed."""


@dataclass(frozen=True, eq=False)
class PoseRecord:
    """The pose of a person in a frame, with its provenance."""

    values: Array
    """Pose, (n_values,), in the order of the body model's `value_names`."""
    sources: tuple[str, ...]
    """Source of each value, one of `SOURCES`, (n_values,)."""
    model_revision: int
    """The body model that the values belong to."""
    keyframe: bool = False
    """Whether a person set or verified the frame, so that no program may change it."""
    status: str = ""
    """Quality as assessed by its tracker, one of `STATUSES`."""
    cost_px: float | None = None
    """Mean cost over the views, px; None if not computed."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings of the program that made it; any JSON values."""
    author: str = ""
    """Author of the edit; filled in by the store, like the next two."""
    time: str = ""
    """Time of the edit, ISO 8601, UTC."""
    program: str = ""
    """Version of the program that made the edit."""
    view_costs_px: tuple[float | None, ...] = ()
    """Cost of each view in the order of the session's cameras, px; None without edges, empty where unknown."""
    part_costs_px: tuple[float | None, ...] = ()
    """Cost of each part in the order of the body model's, px; None for an unseen part, empty where unknown."""
    remark: str = ""
    """Note of the tracker on the frame, for display."""
    reviewed: bool = False
    """Whether a person has checked it and left it unchanged. A keyframe counts as reviewed too."""
    limbs_lost: tuple[float, ...] = ()
    """Probability that each limb is lost, in the order of `tracker.body.limbs.limbs`; empty where not assessed."""
    errors: Array | None = None
    """Covariance of each point of the body in the order of its `point_names`, (n_points, 3, 3), m^2; None where not
    known."""
    trace: tuple[Search, ...] | None = None
    """The searches of the tracker on the frame, in their order; None where they are not known."""

    @property
    def seam_mm(self) -> float | None:
        """How far the passes from the two keyframes around the frame lie apart, mm; None elsewhere."""
        seam = self.settings.get(SEAM)
        return None if seam is None else float(seam)


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another pose of a person in a frame, about as good as the chosen one."""

    values: Array
    """Pose, (n_values,), in the order of the body model's `value_names`."""
    model_revision: int
    """The body model that the values belong to."""
    cost_px: float | None = None
    """Mean cost over the views, with the other people in their estimated poses, px; None if not computed."""


@dataclass(frozen=True, eq=False)
class PoseChange:
    """Set the pose of a person in a frame, or clear it."""

    person: str
    frame: int
    pose: PoseRecord | None
    """The new pose; None clears."""
    alternatives: tuple[Alternative, ...] = ()
    """Alternatives, best first, that a person may choose instead."""


class MarkChange(NamedTuple):
    """Mark the pose of a person in a frame without changing it; a frame without pose is ignored."""

    person: str
    frame: int
    keyframe: bool
    """Whether a person set or verified it, so that no program may change it."""
    reviewed: bool
    """Whether a person has checked it."""


class AssessmentChange(NamedTuple):
    """Set what is known about the pose of a person in a frame without changing it, also of a keyframe.

    Author, time and program stay those of the pose. A frame that shows another pose by now is ignored.
    """

    person: str
    frame: int
    values: Array
    """The pose that was assessed, (n_values,)."""
    status: str
    """One of `STATUSES`."""
    remark: str
    limbs_lost: tuple[float, ...]
    """See `PoseRecord.limbs_lost`."""
    errors: Array | None
    """See `PoseRecord.errors`."""
    cost_px: float | None = None
    """See `PoseRecord.cost_px`; None leaves both costs as they are."""
    view_costs_px: tuple[float | None, ...] = ()
    """See `PoseRecord.view_costs_px`."""

    @classmethod
    def of(cls, person: str, frame: int, pose: PoseRecord) -> "AssessmentChange":
        """Return what a record says about its pose."""
        return cls(
            person, frame, pose.values, pose.status, pose.remark, pose.limbs_lost, pose.errors, pose.cost_px,
            pose.view_costs_px,
        )  # fmt: skip


class PinChange(NamedTuple):
    """Set a pin, or clear it."""

    person: str
    frame: int
    point: str
    """One of the body model's `point_names`."""
    camera: str
    position_px: tuple[float, float] | None
    """Position of the point in the image, original pixels; None clears."""


class Pin(NamedTuple):
    """The position of a body point in an image, set by a person."""

    point: str
    camera: str
    position_px: tuple[float, float]
    """Original pixels."""


Change = PoseChange | MarkChange | AssessmentChange | PinChange


class Committed(NamedTuple):
    """The result of a commit."""

    edit: int
    """Id of the edit, for `amend`."""
    skipped: tuple[tuple[str, int], ...]
    """Person and frame of the keyframes left unchanged because a program made the edit."""


class FrameRow(NamedTuple):
    """A summary of a frame that has a pose."""

    frame: int
    source: str
    """The most manual source of its values (the first in `SOURCES`)."""
    status: str
    cost_px: float | None
    keyframe: bool
    view_costs_px: tuple[float | None, ...] = ()
    """Cost of each view, px; None without edges, empty where unknown."""
    remark: str = ""
    """Note of the tracker on the frame, for display."""
    reviewed: bool = False
    """Whether a person has checked or set it."""
    ambiguous: bool = False
    """Whether it has alternatives and is no keyframe."""
    limbs_lost: tuple[float, ...] = ()
    """Probability that each limb is lost, in the order of `tracker.body.limbs.limbs`; empty where not assessed."""
    assessed_since: bool = False
    """Whether it was assessed after it was set or marked; see `AssessmentChange`."""
    change: int = 0
    """Number of the change that wrote it; later ones are greater."""


class FramePose(NamedTuple):
    """The pose and costs of a frame."""

    frame: int
    values: Array
    """Pose, (n_values,), of the body model that it was made with."""
    cost_px: float | None
    view_costs_px: tuple[float | None, ...]
    """Cost of each view, px; None without edges, empty where unknown."""
    model_revision: int = 0
    """The body model that the values belong to."""


class HistoryEntry(NamedTuple):
    """An edit that can be undone or redone."""

    edit: RowId
    label: str
    author: str
    time: Time
    undone: bool = False
    """Whether it is undone, so that redo applies it."""


class ModelRevision(NamedTuple):
    """A body model that poses were made with; never changed."""

    id: RowId
    person: str
    toml: str
    """Text of the model file, including its dimensions."""
    time: Time


DERIVED = "edit_uid((SELECT value FROM main.settings WHERE key = 'store_id'), id, parent, label, author, time, program)"
"""SQL for the identity of a row of `edits` of an older store."""


def new_uid() -> str:
    """Return a random identity of 128 bits, 32 hexadecimal digits."""
    return secrets.token_hex(16)


def derived_uid(*content: object) -> str:
    """Return the identity that follows from the content of a row: texts, numbers and None."""
    # `ascii` writes them the same in all versions of Python; 32 digits are 128 bits, as for new rows.
    return sha256(ascii(content).encode("ascii")).hexdigest()[:32]


def register(db: sqlite3.Connection) -> None:
    """Make `edit_uid` known to a connection."""
    db.create_function("edit_uid", -1, derived_uid, deterministic=True)
