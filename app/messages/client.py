"""Messages from the page to the program: the one declaration of their types, fields and limits.

`parsing` checks messages by these declarations. `tests/recipes/protocol_docs.py` writes the page's types and
docs/protocol.md from them.
Messages that change poses or run searches are in `pose` and `search`, those of the inspector in `inspector`.
"""

from typing import Annotated, Literal, TypeAlias, Union, get_args

from msgspec import Meta

from app.drawing.curves import CurveGroup
from app.messages.annotation import AskNextClick, DecideTask, PlanTasks, ResolveComment, WriteComment
from app.messages.base import Command, Dofs, Frame, Index, Name, Number
from app.messages.cameras import CheckCalibration, UseClocks
from app.messages.inspector import InspectorCommand
from app.messages.observation import SetCopyTolerance, UseCopy, UseObservations, WatchProvenance
from app.messages.pose import Drag, DragPin, FitPose, PoseEdit, RemovePins, TakeLimbBack
from app.messages.search import SearchCommand
from app.state.page_view import Layer

RangeAction: TypeAlias = Literal[
    "track_forward",
    "track_backward",
    "interpolate",
    "estimate",
    "clear",
    "keyframe",
    "reviewed",
    "unreviewed",
    "none",
    "take_replaced",
]
Tab: TypeAlias = Literal["search", "landscape"]


# --- looking -------------------------------------------------------------------------------------------------------


class Seek(Command, frozen=True, tag="seek"):
    """Show a frame. Playback is a series of these, paced by the arrival of the pictures."""

    frame: Frame


class Select(Command, frozen=True, tag="select"):
    """Choose the person and the point that the panels show."""

    person: Index
    point: Name | None = None
    """The point last touched."""


class SetView(Command, frozen=True, tag="view"):
    """Choose what this page shows. Nothing is drawn for a page before its first `view`."""

    layers: Annotated[list[Layer], Meta(max_length=64)]
    reductions: Annotated[list[Annotated[float, Meta(ge=0, le=64)]], Meta(max_length=1024)]
    """By camera: image pixels per picture pixel along either side, 1 to 64; 0 for a pane that is not visible."""
    by_part: bool
    """Whether contours have the colours of the parts instead of those of the people."""


class CheckEpipolar(Command, frozen=True, tag="epipolar"):
    """Ask for the line of sight of a pixel in the other views, and how far another pixel is from it.

    The answer is `epipolar`, again whenever cameras or poses change. Without points it ends.
    """

    points: Annotated[list[tuple[Index, Number, Number]], Meta(max_length=2)]
    """Camera, u and v of each."""


class ShowPerson(Command, frozen=True, tag="people"):
    """Show or hide a person in all views and in the 3-D view. No pose changes."""

    action: Literal["show"]
    person: Index
    shown: bool


class Solo(Command, frozen=True, tag="people"):
    """Dim everybody but the person worked on, or stop dimming."""

    action: Literal["solo"]
    on: bool


class ShowBefore(Command, frozen=True, tag="before"):
    """Show the poses before the last fit or search, or its result again. No pose changes."""

    shown: bool


class ShowCurves(Command, frozen=True, tag="curves"):
    """Subscribe to a group of curves of the person worked on; null unsubscribes."""

    group: CurveGroup | None


class WatchTab(Command, frozen=True, tag="watch"):
    """Subscribe to what a tab of the drawer shows; null unsubscribes."""

    tab: Tab | None


class ShowHistory(Command, frozen=True, tag="history"):
    """Subscribe to the history."""

    limit: Index
    """Entries to list in each direction, at most 2,000; 0 unsubscribes."""


class LookThrough(Command, frozen=True, tag="snap"):
    """Look through a camera in the 3-D view, its image behind the bodies; null releases the view."""

    camera: Index | None


class Pause3d(Command, frozen=True, tag="pause_3d"):
    """Pause the 3-D view during drags. A page sends it on connecting if its browser renders WebGL in software."""

    pause: bool


# --- tracking and ranges -------------------------------------------------------------------------------------------


class StartTracking(Command, frozen=True, tag="track"):
    """Track from the shown frame."""

    action: Literal["forward", "backward"]
    until: Frame | None = None
    """Last frame; null for the end of the recording."""


class ControlTracking(Command, frozen=True, tag="track"):
    """Pause, resume or end a tracking run; tracked frames stay."""

    action: Literal["pause", "resume", "stop"]


class EditRange(Command, frozen=True, tag="range"):
    """Track, interpolate, estimate, clear or mark a range of frames, or take the poses that its poses replaced."""

    action: RangeAction
    first: Frame
    last: Frame
    """Included."""
    person: Index | None = None
    """Null for everybody. Tracking always moves everybody who is placed."""


class EditCurves(Command, frozen=True, tag="range"):
    """Smooth degrees of freedom of a person over a range, all but keyframes, or shift them, keyframes too."""

    action: Literal["smooth", "shift"]
    first: Frame
    last: Frame
    """Included."""
    person: Index
    dofs: Dofs
    amount: Number
    """Cutoff in hertz, or the shift in degrees or centimetres."""


class CompareRange(Command, frozen=True, tag="compare_range"):
    """Compare the poses of a range with those that they replaced; null ends the comparison."""

    first: Frame | None
    last: Frame | None
    """Included."""


class StopRange(Command, frozen=True, tag="stop_range"):
    """Stop the work on a range; what is written stays."""


class ToggleMark(Command, frozen=True, tag="mark"):
    """Mark the shown pose of the person worked on as keyframe or as reviewed, or remove the mark."""

    toggle: Literal["keyframe", "reviewed"]


class ConfirmKeyframe(Command, frozen=True, tag="confirm_keyframe"):
    """Keep a doubted keyframe as it is: it is not doubted again until its pose changes. No entry of the history."""

    person: Index
    frame: Frame


class FollowTracking(Command, frozen=True, tag="follow"):
    """Show each frame as it is tracked, or stay at the shown frame."""

    follow: bool


# --- floor ---------------------------------------------------------------------------------------------------------


class EditFloor(Command, frozen=True, tag="floor"):
    """Set the floor from three points: start, go to the next point, remove the last mark, apply or cancel.

    `from_feet` sets it to the plane under the feet in all poses; `revert` restores the floor before the last change.
    """

    action: Literal["begin", "next", "take_back", "apply", "cancel", "from_feet", "revert"]


class MarkFloor(Command, frozen=True, tag="floor"):
    """Mark the current floor point in a view, replacing its mark there."""

    action: Literal["mark"]
    camera: Index
    u: Number
    v: Number


# --- history -------------------------------------------------------------------------------------------------------


class Undo(Command, frozen=True, tag="undo"):
    """Undo one entry of the history."""


class Redo(Command, frozen=True, tag="redo"):
    """Redo one entry of the history."""


class GoTo(Command, frozen=True, tag="go_to"):
    """Undo or redo until an entry is the last one done; null undoes everything."""

    edit: Index | None


class Save(Command, frozen=True, tag="save"):
    """Retry writing unsaved edits."""


ClientMessage: TypeAlias = Union[  # noqa: UP007
    Seek, Select, SetView, CheckEpipolar, ShowPerson, Solo, ShowBefore, ShowCurves, WatchTab, ShowHistory,
    LookThrough, Pause3d,
    Drag, PoseEdit, DragPin, RemovePins, FitPose, TakeLimbBack,
    SearchCommand, StartTracking, ControlTracking, EditRange, EditCurves, CompareRange, StopRange, ToggleMark,
    ConfirmKeyframe, FollowTracking, InspectorCommand, CheckCalibration, UseClocks, UseObservations, WatchProvenance,
    UseCopy, SetCopyTolerance, PlanTasks, DecideTask, WriteComment, ResolveComment, AskNextClick,
    EditFloor, MarkFloor, Undo, Redo, GoTo, Save,
]  # fmt: skip

CLIENT_MESSAGES: tuple[type[Command], ...] = get_args(ClientMessage)
"""All types of messages, in the order of docs/protocol.md."""
