"""Messages about work from elsewhere, as `base` explains: imported observations, another copy of the session,
and where each pose comes from."""

from typing import Annotated, Literal

from msgspec import Meta

from app.messages.base import Command, Frame, Index, Message, Name, Part, WorkMessage
from app.state.observations import ObservedSet

# --- from the page --------------------------------------------------------------------------------------------------


class UseObservations(Command, frozen=True, tag="observations"):
    """Show imported observations, judge them by the footage, take them as poses, track with them, or stop that.

    `POST observations/plan` reads files, and `POST observations/import` stores them: paths come by such requests alone.
    """

    action: Literal["show", "judge", "take", "track", "track_contours", "detect", "detect_track", "stop", "discard"]
    """`track` finds who has no pose by the key points and tracks by contours and key points; `track_contours` tracks by
    contours alone. `detect_track` detects people by a network, unless that was done, and goes on as `track`.
    `find_people` stops what tracks. `discard` forgets files that were read and are not imported."""
    name: Name = ""
    """Name of the set; with `show`, empty for none."""


class WatchProvenance(Command, frozen=True, tag="provenance"):
    """Ask where the pose of a person comes from, as long as the page shows it. The answer is `provenance`."""

    person: Index | None
    """Null ends it."""
    annotators: bool = False
    """Whether the page filters by annotator, and needs `annotators`."""


class UseCopy(Command, frozen=True, tag="other_copy"):
    """Decide between the poses of this session and of another copy that is compared with it, or end the comparison.

    `POST copies/open` opens a copy: its path comes by such a request alone.
    """

    action: Literal["keep", "take", "mean", "leave"]
    person: Index = 0
    frame: Frame = 0


class SetCopyTolerance(Command, frozen=True, tag="other_copy"):
    """Set up to which distance two poses count as one."""

    action: Literal["tolerance"]
    tolerance_mm: Annotated[float, Meta(ge=0, le=10_000)]


# --- to the page ----------------------------------------------------------------------------------------------------


class JudgedPerson(Part, frozen=True):
    """Judgement of one person."""

    name: str
    share_in_order: float
    """Share of the frames on which no limb is off, 0 to 1."""
    frames: int
    """Number of frames that were judged."""
    sentences: tuple[str, ...]
    """Sentences on what is off throughout."""


class JudgedLimb(Part, frozen=True):
    """A limb that is off on a frame."""

    person: int
    frame: int
    limb: str
    joint: str
    """Its farthest joint."""
    reason: str
    probability: float
    """That it is off."""
    distance_mm: float
    """Distance of its farthest joint from the tracked one."""


class ObservationsMessage(WorkMessage, frozen=True, tag="imported"):
    """Imported observations, the work on them, and their judgement."""

    sets: tuple[ObservedSet, ...]
    shown: str
    """Name of the set that the views show, or empty."""
    is_previewed: bool
    """Whether the views show files that are not imported yet."""
    judged: str
    """Name of the set of the judgement, or empty."""
    people: tuple[JudgedPerson, ...]
    worst: tuple[JudgedLimb, ...]
    """The limbs that are off, the most likely and farthest first; at most 500."""
    off: int
    """Number of all limbs that are off, of all frames."""


class PointProvenance(Part, frozen=True):
    """Origin of the place of a point."""

    point: str
    source: str
    author: str
    """Author of the edit that gave it this source; empty for nobody named."""
    time: str
    """Time of this edit, ISO 8601, UTC."""
    views: tuple[str, ...]
    """Cameras in which a person put it."""
    lost: float | None
    """Probability that its limb is lost; null where it was not assessed."""


class ProvenanceMessage(Message, frozen=True, tag="provenance"):
    """Origin of the stored pose of a person on the shown frame; only for a page that asks for it."""

    frame: int
    person: int
    source: str | None
    """Its most manual source; null without a stored pose."""
    author: str
    """Author of the edit that made or marked it; empty for nobody named."""
    time: str
    program: str
    """Version of the program that made the edit."""
    keyframe: bool
    reviewed: bool
    method: str
    """Method of the tracker, or another program's work; empty where none is known."""
    between: tuple[int, int] | None
    """The two keyframes that it was tracked or interpolated between."""
    seam_mm: float | None
    """How far the passes from both lie apart."""
    imported_from: str
    """Set of observations, or empty."""
    taken_from: str
    """Copy of the session that it was taken from, in words; or empty."""
    body: str
    """Name of the body model."""
    body_revision: int
    is_earlier_body: bool
    """Whether the person has another body now."""
    calibration_revision: int
    is_earlier_calibration: bool
    """Whether the session has another calibration now."""
    points: tuple[PointProvenance, ...]


class AnnotatorsMessage(Message, frozen=True, tag="annotators"):
    """Keyframes by the annotator who set or marked them last; only for a page that filters by them."""

    people: tuple[dict[str, tuple[int, ...]], ...]
    """By person: frames of each annotator, ascending; the name is empty for nobody named."""


class CopyDifferenceInfo(Part, frozen=True):
    """How far two copies differ on a frame that both annotated."""

    frame: int
    joint: str
    """Its farthest joint."""
    distance_mm: float
    decided: bool
    """Whether the user has decided between the two poses, and the pose is unchanged since."""


class OtherCopyMessage(Message, frozen=True, tag="other_copy"):
    """The copy of the session that is compared with it."""

    name: str
    """Of the copy; empty while none is compared."""
    own_name: str
    tolerance_mm: float
    notes: tuple[str, ...]
    """Sentences on what else differs."""
    posed: tuple[bool, ...]
    """Whether the other copy has a pose of each person on the shown frame."""
    people: tuple[tuple[CopyDifferenceInfo, ...], ...]
    """By person, ascending by frame."""
