"""Messages from the page to the program: the one declaration of their types, fields and limits.

`message_parsing` checks messages against these declarations, `protocol_docs` writes the page's types and
docs/protocol.md from them. Positions are in undistorted pixels, frames count from 0, cameras and people are indices
into the session's lists.
"""

from typing import Annotated, Literal, TypeAlias, Union, get_args

import msgspec
from msgspec import UNSET, Meta, UnsetType

from app.drawing.curves import CurveGroup
from app.state.page_view import Layer

_MAX_INT = 2**31
_MAX_NUMBER = 1e9

Frame: TypeAlias = Annotated[int, Meta(ge=0, le=_MAX_INT)]
Index: TypeAlias = Annotated[int, Meta(ge=0, le=_MAX_INT)]
Number: TypeAlias = Annotated[float, Meta(ge=-_MAX_NUMBER, le=_MAX_NUMBER)]
Name: TypeAlias = Annotated[str, Meta(max_length=200)]

GesturePhase: TypeAlias = Literal["start", "move", "end", "cancel"]
DragMode: TypeAlias = Literal["move", "turn", "push"]
RangeAction: TypeAlias = Literal[
    "track_forward", "track_backward", "interpolate", "clear", "keyframe", "reviewed", "unreviewed", "none"
]
Tab: TypeAlias = Literal["search", "landscape"]
OutlierMode: TypeAlias = Literal["truncated", "paper"]


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message from a page."""


# --- looking -------------------------------------------------------------------------------------------------------


class Seek(Message, frozen=True, tag="seek"):
    """Show a frame. Playback is a series of these, paced by the arrival of the pictures."""

    frame: Frame


class Select(Message, frozen=True, tag="select"):
    """Choose the person and the point that the panels show."""

    person: Index
    point: Name | None = None
    """The point last touched."""


class SetView(Message, frozen=True, tag="view"):
    """Choose what this page shows. Nothing is drawn for a page before its first `view`."""

    layers: Annotated[list[Layer], Meta(max_length=64)]
    reductions: Annotated[list[Annotated[float, Meta(ge=0, le=64)]], Meta(max_length=1024)]
    """By camera: image pixels per picture pixel along either side, 1 to 64; 0 for a pane that is not visible."""
    by_part: bool
    """Whether contours have the colours of the parts instead of those of the people."""


class ShowPerson(Message, frozen=True, tag="people"):
    """Show or hide a person in all views and in the 3-D view. No pose changes."""

    action: Literal["show"]
    person: Index
    shown: bool


class Solo(Message, frozen=True, tag="people"):
    """Dim everybody but the person worked on, or stop dimming."""

    action: Literal["solo"]
    on: bool


class ShowCurves(Message, frozen=True, tag="curves"):
    """Subscribe to a group of curves of the person worked on; null unsubscribes."""

    group: CurveGroup | None


class WatchTab(Message, frozen=True, tag="watch"):
    """Subscribe to what a tab of the drawer shows; null unsubscribes."""

    tab: Tab | None


class ShowHistory(Message, frozen=True, tag="history"):
    """Subscribe to the history."""

    limit: Index
    """Entries to list in each direction, at most 2,000; 0 unsubscribes."""


class LookThrough(Message, frozen=True, tag="snap"):
    """Look through a camera in the 3-D view, its image behind the bodies; null releases the view."""

    camera: Index | None


class Pause3d(Message, frozen=True, tag="pause_3d"):
    """Pause the 3-D view during drags. A page sends it on connecting if its browser renders WebGL in software."""

    pause: bool


# --- posing --------------------------------------------------------------------------------------------------------


class Drag(Message, frozen=True, tag="drag"):
    """Drag a point, or a part by its surface."""

    phase: GesturePhase
    frame: Frame
    """The frame under the pointer; a tracker may have moved on."""
    camera: Index
    person: Index
    point: Name
    """Name of the point; ignored if `part` is given."""
    u: Number
    v: Number
    seq: Index
    """Rises by one with every drag message of a page."""
    part: Index | None = None
    """Part held by its surface."""
    mode: DragMode = "move"


class _PoseEdit(Message, frozen=True, tag="pose"):
    """An edit of one pose."""

    frame: Frame
    person: Index


class SetDof(_PoseEdit, frozen=True, tag="pose"):
    """Set a degree of freedom, clamped to its limits."""

    action: Literal["set"]
    dof: Index
    value: Number
    """Degrees or centimetres."""


class TurnDof(_PoseEdit, frozen=True, tag="pose"):
    """Step a degree of freedom."""

    action: Literal["turn"]
    dof: Index
    by: Number
    """Degrees or centimetres."""


class Nudge(_PoseEdit, frozen=True, tag="pose"):
    """Move a point parallel to the image of a view."""

    action: Literal["nudge"]
    camera: Index
    right: Number
    """Centimetres."""
    up: Number
    """Centimetres."""
    point: Name | None = None
    """Null moves the body."""


class Mirror(_PoseEdit, frozen=True, tag="pose"):
    """Exchange left and right; the root stays."""

    action: Literal["mirror"]


class CopyFrame(_PoseEdit, frozen=True, tag="pose", rename={"source": "from"}):
    """Copy the stored pose of another frame."""

    action: Literal["copy"]
    source: Frame
    """Frame to copy from."""


class CopyPerson(_PoseEdit, frozen=True, tag="pose", rename={"source": "from"}):
    """Copy the joints that another person has by the same names on this frame; position and heading stay."""

    action: Literal["copy_person"]
    source: Index
    """Person to copy from."""


class TakeAlternative(_PoseEdit, frozen=True, tag="pose"):
    """Replace a tracked pose by its alternative, as a keyframe; repeated, go back.

    People who may have been confused are exchanged together.
    """

    action: Literal["alternative"]


class ResetLimb(_PoseEdit, frozen=True, tag="pose"):
    """Reset the limb of a point to the neutral pose."""

    action: Literal["reset"]
    point: Name | None = None
    """Null, or the root, resets everything but the root."""


class LockDofs(_PoseEdit, frozen=True, tag="pose"):
    """Lock or unlock degrees of freedom. Locks are stored with the session and are no entry of the history."""

    action: Literal["lock"]
    dofs: Annotated[list[Index], Meta(max_length=1000)]
    locked: bool


PoseEdit: TypeAlias = Union[  # noqa: UP007
    SetDof, TurnDof, Nudge, Mirror, CopyFrame, CopyPerson, TakeAlternative, ResetLimb, LockDofs
]


class DragPin(Message, frozen=True, tag="pin"):
    """Set or drag a pin: the position of a joint in a view."""

    phase: GesturePhase
    frame: Frame
    camera: Index
    person: Index
    point: Name
    u: Number
    v: Number
    live: bool
    """Whether the body follows the pin."""


class RemovePins(Message, frozen=True, tag="unpin"):
    """Remove pins of a person on a frame."""

    frame: Frame
    person: Index
    point: Name | None
    """Null for all points."""
    camera: Index | None
    """Null for all views."""


class FitPose(Message, frozen=True, tag="fit"):
    """Fit to pins and edges together."""

    frame: Frame
    person: Index | None = None
    """Null for the person worked on and everybody who is placed or pinned on the frame."""


# --- searching -----------------------------------------------------------------------------------------------------


class RunSearch(Message, frozen=True, tag="search"):
    """Search the shown frame: one expansion, to the end of the stage, or the whole frame; or stop.

    A search of other people than the current one starts from the beginning.
    """

    action: Literal["step", "stage", "frame", "stop"]
    person: Index | None = None
    """The only person to search; null for everybody."""


class RepeatSearch(Message, frozen=True, tag="search"):
    """Search again from the start of a run of this frame, with the present settings."""

    action: Literal["again"]
    run: Index | None = None
    """Number of the run; null for the newest."""
    person: Index | None = None
    """The only person to search; null for everybody."""


class SetSearchSpeed(Message, frozen=True, tag="search_speed"):
    """Limit the speed of a search that is watched, effective at once."""

    per_second: Number | None
    """Expansions per second; null for no limit."""


class LeafChanges(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Bounds and steps of one group of degrees of freedom; null for those of all groups."""

    person: Index
    name: Name
    bound_rad: Number | UnsetType | None = UNSET
    bound_m: Number | UnsetType | None = UNSET
    step_rad: Number | UnsetType | None = UNSET
    step_m: Number | UnsetType | None = UNSET


class SearchChanges(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the search to change; what is left out stays."""

    theta_px: Number | UnsetType | None = UNSET
    """Null for the default."""
    outliers: OutlierMode | UnsetType = UNSET
    passes: Annotated[list[Number], Meta(max_length=100)] | UnsetType = UNSET
    """Factors on the steps: all stages are searched once per factor."""
    patience: Index | UnsetType = UNSET
    """Expansions without improvement after which a stage ends."""
    max_expansions: Index | UnsetType = UNSET
    limbs_apart: bool | UnsetType = UNSET
    """Whether limbs are searched one after the other."""
    bound_rad: Number | UnsetType = UNSET
    bound_m: Number | UnsetType = UNSET
    step_rad: Number | UnsetType = UNSET
    step_m: Number | UnsetType = UNSET
    leaf: LeafChanges | UnsetType = UNSET


class SetSearchSettings(Message, frozen=True, tag="search_settings"):
    """Change settings of the search."""

    changes: SearchChanges


class ReplayStep(Message, frozen=True, tag="replay"):
    """Show a recorded step of a search in place of the stored poses."""

    run: Index | None
    """Number of the run; null shows the stored poses again."""
    step: Annotated[int, Meta(ge=-1, le=_MAX_INT)] = -1
    """Index of the step; -1 for the start."""


class CompareRun(Message, frozen=True, tag="compare"):
    """Draw the result of a run over the views; null draws none."""

    run: Index | None


class PreviewCandidate(Message, frozen=True, tag="preview"):
    """Draw a candidate of a run over the views; null draws none."""

    run: Index
    candidate: Index | None


class TakeCandidate(Message, frozen=True, tag="take"):
    """Take over a candidate of a run as an edit; null for the run's result."""

    run: Index
    candidate: Index | None


class ShowLandscape(Message, frozen=True, tag="landscape"):
    """Choose the degree of freedom of the person worked on whose cost landscape is shown."""

    dof: Name


class SetLandscapeDof(Message, frozen=True, tag="landscape_set"):
    """Set a degree of freedom to a value of its landscape, as an edit."""

    person: Index
    dof: Index
    value: Number
    """Radians or metres."""


# --- tracking and ranges -------------------------------------------------------------------------------------------


class StartTracking(Message, frozen=True, tag="track"):
    """Track from the shown frame."""

    action: Literal["forward", "backward"]
    until: Frame | None = None
    """Last frame; null for the end of the recording."""


class ControlTracking(Message, frozen=True, tag="track"):
    """Pause, resume or end a tracking run; tracked frames stay."""

    action: Literal["pause", "resume", "stop"]


class EditRange(Message, frozen=True, tag="range"):
    """Track, interpolate, clear or mark a range of frames."""

    action: RangeAction
    first: Frame
    last: Frame
    """Included."""
    person: Index | None = None
    """Null for everybody. Tracking always moves everybody who is placed."""


class StopRange(Message, frozen=True, tag="stop_range"):
    """Stop the work on a range; what is written stays."""


class ToggleMark(Message, frozen=True, tag="mark"):
    """Mark the shown pose of the person worked on as keyframe or as reviewed, or remove the mark."""

    toggle: Literal["keyframe", "reviewed"]


class FollowTracking(Message, frozen=True, tag="follow"):
    """Show each frame as it is tracked, or stay at the shown frame."""

    follow: bool


# --- floor ---------------------------------------------------------------------------------------------------------


class EditFloor(Message, frozen=True, tag="floor"):
    """Set the floor from three points: start, go to the next point, remove the last mark, apply or cancel.

    `revert` restores the floor before the last change.
    """

    action: Literal["begin", "next", "take_back", "apply", "cancel", "revert"]


class MarkFloor(Message, frozen=True, tag="floor"):
    """Mark the current floor point in a view, replacing its mark there."""

    action: Literal["mark"]
    camera: Index
    u: Number
    v: Number


# --- history -------------------------------------------------------------------------------------------------------


class Undo(Message, frozen=True, tag="undo"):
    """Undo one entry of the history."""


class Redo(Message, frozen=True, tag="redo"):
    """Redo one entry of the history."""


class GoTo(Message, frozen=True, tag="go_to"):
    """Undo or redo until an entry is the last one done; null undoes everything."""

    edit: Index | None


class Save(Message, frozen=True, tag="save"):
    """Retry writing unsaved edits."""


ClientMessage: TypeAlias = Union[  # noqa: UP007
    Seek, Select, SetView, ShowPerson, Solo, ShowCurves, WatchTab, ShowHistory, LookThrough, Pause3d,
    Drag, PoseEdit, DragPin, RemovePins, FitPose,
    RunSearch, RepeatSearch, SetSearchSpeed, SetSearchSettings, ReplayStep, CompareRun, PreviewCandidate,
    TakeCandidate, ShowLandscape, SetLandscapeDof,
    StartTracking, ControlTracking, EditRange, StopRange, ToggleMark, FollowTracking,
    EditFloor, MarkFloor, Undo, Redo, GoTo, Save,
]  # fmt: skip

CLIENT_MESSAGES: tuple[type[Message], ...] = get_args(ClientMessage)
"""All types of messages, in the order of docs/protocol.md."""
