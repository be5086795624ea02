"""What the store of annotations takes and gives: poses with their provenance, pins, edits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from tracker.geometry.arrays import Array

# From a person's hand to a foreign file. Stored by index: add at the end, never reorder.
SOURCES = ("manual", "pinned", "searched", "fitted", "tracked", "interpolated", "smoothed", "imported")
# How good a pose is, as its tracker judges; empty where nobody has judged it.
STATUSES = ("", "good", "doubtful", "lost")


@dataclass(frozen=True, eq=False)
class PoseRecord:
    """The pose of a person in a frame, and where it came from."""

    values: Array
    """Pose, (n_values,), in the order of the body model's `value_names`."""
    sources: tuple[str, ...]
    """Where each value came from, one of `SOURCES`, (n_values,)."""
    model_revision: int
    """The body model that the values belong to."""
    keyframe: bool = False
    """Whether a person set or verified the frame, so that no program may change it."""
    status: str = ""
    """How good it is as its tracker judges, one of `STATUSES`."""
    cost_px: float | None = None
    """Mean cost over the views, px; None where nobody has computed it."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """What the program that made it was told; anything that JSON holds."""
    author: str = ""
    """Who made the edit; filled in by the store, like the next two."""
    time: str = ""
    """When the edit was made, ISO 8601, UTC."""
    program: str = ""
    """Version of the program that made the edit."""
    views_px: tuple[float | None, ...] = ()
    """Cost of each view in the order of the session's cameras, px; None without edges, empty where unknown."""
    parts_px: tuple[float | None, ...] = ()
    """Cost of each part in the order of the body model's, px; None for an unseen part, empty where unknown."""
    remark: str = ""
    """What the tracker did on the frame, for people to read: `left arm relocated`."""
    reviewed: bool = False
    """Whether a person has looked at it and left it as it is; a keyframe counts as reviewed besides."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another pose of a person in a frame that is about as good as the one that was taken."""

    values: Array
    """Pose, (n_values,), in the order of the body model's `value_names`."""
    model_revision: int
    """The body model that the values belong to."""
    cost_px: float | None = None
    """Mean cost over the views with everybody else as they were found, px; None where nobody has computed it."""


@dataclass(frozen=True, eq=False)
class PoseChange:
    """Set the pose of a person in a frame, or clear it."""

    person: str
    frame: int
    pose: PoseRecord | None
    """The new pose; None clears."""
    alternatives: tuple[Alternative, ...] = ()
    """Poses that are about as good, best first, for a person to choose from; kept as long as the pose is shown."""


class MarkChange(NamedTuple):
    """Mark the pose of a person in a frame, which stays as it is; nothing happens where there is none."""

    person: str
    frame: int
    keyframe: bool
    """Whether a person vouches for it, so that no program may change it."""
    reviewed: bool
    """Whether a person has looked at it."""


class PinChange(NamedTuple):
    """Set a pin, or clear it."""

    person: str
    frame: int
    point: str
    """One of the body model's `point_names`."""
    camera: str
    position_px: tuple[float, float] | None
    """Where the point is seen, original pixels; None clears."""


class Pin(NamedTuple):
    """Where a person says that a point of the body is seen."""

    point: str
    camera: str
    position_px: tuple[float, float]
    """Original pixels."""


Change = PoseChange | MarkChange | PinChange


class Committed(NamedTuple):
    """What became of a commit."""

    edit: int
    """Id of the edit, for `amend`."""
    skipped: tuple[tuple[str, int], ...]
    """Person and frame of the keyframes that a program was kept from changing."""


class FrameRow(NamedTuple):
    """A frame that has a pose, in short."""

    frame: int
    source: str
    """The source of any of its values that is nearest to a person's hand (the first in `SOURCES`)."""
    status: str
    cost_px: float | None
    keyframe: bool
    views_px: tuple[float | None, ...] = ()
    """Cost of each view, px; None without edges, empty where unknown."""
    remark: str = ""
    """What the tracker did on the frame."""
    reviewed: bool = False
    """Whether a person has looked at it, or set it."""
    ambiguous: bool = False
    """Whether other poses are about as good and nobody has vouched for this one."""


class FrameNumbers(NamedTuple):
    """The numbers of a frame that has a pose, for curves."""

    frame: int
    values: Array
    """Pose, (n_values,), of the body model that it was made with."""
    cost_px: float | None
    views_px: tuple[float | None, ...]
    """Cost of each view, px; None without edges, empty where unknown."""
    model_revision: int = 0
    """The body model that the values belong to."""


class HistoryEntry(NamedTuple):
    """An edit that can be undone or redone."""

    edit: int
    label: str
    author: str
    time: str
    undone: bool
    """Whether redo would do it again."""


class ModelRevision(NamedTuple):
    """A body model as it was when poses were made with it; never changed."""

    id: int
    person: str
    toml: str
    """Text of the model file, with its sizes."""
    time: str
