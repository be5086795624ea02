"""Messages about imported observations, as `message_types` explains."""

from typing import Literal

from app.page.message_types import Command, Message, Name, Part

# --- from the page --------------------------------------------------------------------------------------------------


class UseObservations(Command, frozen=True, tag="observations"):
    """Show imported observations, judge them by the footage, take them as poses, track with them, or stop that.

    `POST observations/plan` reads files, and `POST observations/import` stores them: paths come by such requests alone.
    """

    action: Literal["show", "judge", "take", "track", "track_contours", "stop", "discard"]
    """`track` finds who has no pose by the key points and tracks by contours and key points; `track_contours` tracks by
    contours alone. `find_people` stops both. `discard` forgets files that were read and are not imported."""
    name: Name = ""
    """Name of the set; with `show`, empty for none."""


# --- to the page ----------------------------------------------------------------------------------------------------


class ObservedSetInfo(Part, frozen=True):
    """A set of imported observations."""

    name: str
    format: str
    people: tuple[str, ...]
    is_in_space: bool
    """Whether it has joints in space, not key points in pictures."""
    frames: int
    """Number of frames with points."""
    problem: str
    """Why it cannot be read, or empty."""


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


class ObservationsMessage(Message, frozen=True, tag="imported"):
    """Imported observations, the work on them, and their judgement."""

    sets: tuple[ObservedSetInfo, ...]
    shown: str
    """Name of the set that the views show, or empty."""
    is_previewed: bool
    """Whether the views show files that are not imported yet."""
    running: bool
    stage: str
    """The kind of work."""
    share: float
    """Share of this work that is done, 0 to 1."""
    message: str
    """How the last work ended, or empty."""
    failed: bool
    """Whether it ended with an error."""
    judged: str
    """Name of the set of the judgement, or empty."""
    people: tuple[JudgedPerson, ...]
    worst: tuple[JudgedLimb, ...]
    """The limbs that are off, the most likely and farthest first; at most 500."""
    off: int
    """Number of all limbs that are off, of all frames."""
