"""Messages from the page that change poses, as `base` explains."""

from typing import Literal, TypeAlias, Union

from app.messages.base import Command, Dofs, Frame, GesturePhase, Index, Name, Number

DragMode: TypeAlias = Literal["move", "turn", "push", "bend"]


class _PointerGesture(Command, frozen=True):
    """A gesture of the pointer in a view."""

    phase: GesturePhase
    frame: Frame
    """The frame under the pointer; a tracker may have moved on."""
    camera: Index
    person: Index
    point: Name
    """Name of the point."""
    u: Number
    v: Number


class Drag(_PointerGesture, frozen=True, tag="drag"):
    """Drag a point, or a part by its surface."""

    seq: Index
    """Rises by one with every drag message of a page."""
    part: Index | None = None
    """Part held by its surface; the point is ignored then."""
    mode: DragMode = "move"


class _PoseEdit(Command, frozen=True, tag="pose"):
    """An edit of one pose."""

    frame: Frame
    person: Index


class SetDof(_PoseEdit, frozen=True, tag="pose"):
    """Set a degree of freedom, clamped to its limits."""

    action: Literal["set"]
    dof: Index
    value: Number
    """Degrees or centimetres."""


class TurnDofs(_PoseEdit, frozen=True, tag="pose"):
    """Step degrees of freedom, each clamped to its limits."""

    action: Literal["turn"]
    dofs: Dofs
    by: Number | None
    """Degrees or centimetres, for each; null takes the drag back."""
    drag: Index | None = None
    """Number of the drag of curves, from whose start the step counts; null for a step from the shown pose."""


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
    rank: Index | None = None
    """Rank among those of the pose's reason; null for the best that the tracker stored."""


class ResetLimb(_PoseEdit, frozen=True, tag="pose"):
    """Reset the limb of a point to the neutral pose."""

    action: Literal["reset"]
    point: Name | None = None
    """Null, or the root, resets everything but the root."""


class LockDofs(_PoseEdit, frozen=True, tag="pose"):
    """Lock or unlock degrees of freedom. Locks are stored with the session and are no entry of the history."""

    action: Literal["lock"]
    dofs: Dofs
    locked: bool


class HoldPoint(_PoseEdit, frozen=True, tag="pose"):
    """Hold a point in place while others are dragged, or release it. A drag holds the point that it placed.

    Holds last until the program ends, and are no entry of the history.
    """

    action: Literal["hold"]
    held: bool
    point: Name | None = None
    """Null for all points of the person."""


PoseEdit: TypeAlias = Union[  # noqa: UP007
    SetDof, TurnDofs, Nudge, Mirror, CopyFrame, CopyPerson, TakeAlternative, ResetLimb, LockDofs, HoldPoint
]


class DragPin(_PointerGesture, frozen=True, tag="pin"):
    """Set or drag a pin: the position of a joint in a view."""

    live: bool
    """Whether the body follows the pin."""


class RemovePins(Command, frozen=True, tag="unpin"):
    """Remove pins of a person on a frame."""

    frame: Frame
    person: Index
    point: Name | None
    """Null for all points."""
    camera: Index | None
    """Null for all views."""


class FitPose(Command, frozen=True, tag="fit"):
    """Fit to pins and edges together."""

    frame: Frame
    person: Index | None = None
    """Null for the person worked on and everybody who is placed or pinned on the frame."""
    point: Name | None = None
    """A point of this person whose limb alone is fitted; null for the whole body."""


class TakeLimbBack(Command, frozen=True, tag="limb_back"):
    """Put the limb back that the last fit moved farthest although nobody had touched it; all else stays."""

    frame: Frame
    every: bool = False
    """Whether all limbs that the fit moved so are put back."""
