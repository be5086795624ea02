"""Messages about the plan of annotation and the next best click, as `base` explains."""

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from app.messages.base import Command, Frame, Index, Message, Name, Part
from app.state.role import Role

Text: TypeAlias = Annotated[str, Meta(max_length=2000)]
TaskState: TypeAlias = Literal["draft", "annotated", "verified", "rejected"]

# --- from the page --------------------------------------------------------------------------------------------------


class PlanTasks(Command, frozen=True, tag="annotation"):
    """Plan frames to annotate; tasks that are planned already stay."""

    action: Literal["plan"]
    by: Literal["every", "frames", "diverse", "doubted"]
    """Every n-th frame, a list, the most diverse poses, or doubtful and lost ones."""
    n: Annotated[int, Meta(ge=1, le=100_000)] = 1
    """For `every` and `diverse`."""
    frames: Text = ""
    """For `frames`: frames and half-open ranges, such as `0,40,100:110`."""
    person: Index | None = None
    """Null for everybody."""
    to: Annotated[tuple[Name, ...], Meta(max_length=64)] = ()
    """Names of annotators; empty for anybody."""
    each: bool = False
    """Whether each annotator has all frames; else they are dealt out in turns."""


class DecideTask(Command, frozen=True, tag="annotation"):
    """Verify, reject or withdraw the tasks of a person on a frame. No pose changes."""

    action: Literal["verify", "reject", "withdraw"]
    person: Index
    frame: Frame
    comment: Text = ""
    """Reason of a rejection."""
    pose: Annotated[str, Meta(max_length=32)] = ""
    """`pose` of the task as it was shown; a verdict on another pose is refused. Empty for any pose."""


class WriteComment(Command, frozen=True, tag="annotation"):
    """Comment on a person on a frame."""

    action: Literal["comment"]
    person: Index
    frame: Frame
    limb: Index | None
    """Index among the `limbs` of the person; null for the whole body."""
    text: Text


class ResolveComment(Command, frozen=True, tag="annotation"):
    """Resolve a comment, or open it again."""

    action: Literal["resolve", "reopen"]
    uid: Name


class AskNextClick(Command, frozen=True, tag="annotation"):
    """Ask for the frame, limb and view where a correction lowers the expected error most."""

    action: Literal["next_click"]


# --- to the page ----------------------------------------------------------------------------------------------------


class TaskInfo(Part, frozen=True):
    """A frame of a person that is to be annotated."""

    person: int
    frame: int
    annotator: str
    """Empty for anybody."""
    state: TaskState
    comment: str
    """Reason of the last decision; empty where it no longer counts."""
    by: str
    """Name of the person who brought it to its state, or empty."""
    is_disagreement: bool
    """Whether two merged copies disagreed there."""
    pose: str
    """Identity of its present pose; empty without one."""


class CommentInfo(Part, frozen=True):
    """A comment."""

    uid: str
    person: int
    frame: int
    limb: str
    """Name for display; empty for the whole body."""
    text: str
    author: str
    resolved: bool


class SpeedInfo(Part, frozen=True):
    """How quickly a person annotates and reviews, without pauses; null where there is nothing to divide by."""

    name: str
    verified: int
    """Planned poses that the person annotated and somebody verified."""
    seconds_per_verified: float | None
    edits_per_verified: float | None
    decisions: int
    seconds_per_decision: float | None


class NextClick(Part, frozen=True):
    """A correction that is proposed."""

    frame: int
    person: int
    limb: str
    """For display; `trunk` for shoulders and hips."""
    cameras: tuple[int, ...]
    """Views in which the limb is to be corrected, the one that shows it best first."""
    gain_mm: float
    """By how much it lowers the expected error of the recording."""
    reason: str


class ClickProposal(Part, frozen=True):
    """The search for the next best click, and what came of the last one."""

    number: int
    """Number of the request that was answered last; 0 before the first."""
    running: bool
    message: str
    """Why nothing could be proposed, or empty."""
    click: NextClick | None
    """Null where none pays."""
    error_mm: float | None
    """Expected mean error of the recording at the time of the request."""
    interval_mm: tuple[float, float] | None
    """90% interval of this mean."""
    after_mm: float | None
    """Expected error since poses have changed; null before."""


class PresentPerson(Part, frozen=True):
    """A person who has a page open on the session."""

    name: str
    role: Role
    frame: int
    person: int
    """Index of the selected person."""
    doing: str
    """Work on poses, for display: `drags on frame 12`; empty for none."""
    is_self: bool


class PresenceMessage(Message, frozen=True, tag="presence"):
    """The people on the session and their places. Sent when that changes, at most five times a second."""

    name: str
    """Name by which the page has joined; empty while it shows what the host shows."""
    refusal: str
    """Why the name that the page asked for could not be had, or empty."""
    link: Role
    """Role that the link gives once a name is given."""
    people: tuple[PresentPerson, ...]
    """The host first, then in the order of joining."""


class AnnotationMessage(Message, frozen=True, tag="annotation"):
    """The plan of annotation, comments, speeds, and the next best click."""

    annotator: str
    """Name of the author of decisions and comments."""
    tasks: tuple[TaskInfo, ...]
    """By person, frame and annotator; without withdrawn ones."""
    comments: tuple[CommentInfo, ...]
    """Earliest first."""
    speeds: tuple[SpeedInfo, ...]
    proposal: ClickProposal
