"""Messages about what the inspector edits: settings, the 3-D view and body sizes, as `base` explains."""

from typing import Annotated, Literal, TypeAlias, Union

import msgspec
from msgspec import UNSET, Meta, UnsetType

from app.messages.base import Command, Index, Message, Name, Part, WorkMessage
from app.messages.search import OutlierMode
from app.state.people import AcquiredSize, SideOutlines
from app.state.run_choices import MAX_STRIDE, RunChoices
from app.state.view_3d import MAX_TRAIL_FRAMES, View3d
from tracker.estimation.acquisition.from_contours import SizeMethod
from tracker.estimation.tracking.method import OptionKind

_Metres: TypeAlias = Annotated[float, Meta(gt=0, le=10)]


# --- from the page --------------------------------------------------------------------------------------------------


class TrackChanges(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the tracker to change; what is left out stays."""

    method: Name | UnsetType = UNSET
    """Name of the tracking method."""
    stride: Annotated[int, Meta(ge=1, le=MAX_STRIDE)] | UnsetType = UNSET
    """Every so many frames are tracked."""
    cameras: Annotated[list[Name], Meta(max_length=1000)] | UnsetType = UNSET
    """Names of the cameras to track with; all if empty."""
    options: dict[Name, bool | float | Name | None] | UnsetType = UNSET
    """Options of methods by name, see `MethodInfo`; null for the default."""


class SetTrackSettings(Command, frozen=True, tag="track_settings"):
    """Change settings of the tracker; kept with the session."""

    changes: TrackChanges


class View3dChanges(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Change the content of the 3-D view; a field that is left out stays."""

    bodies: bool | UnsetType = UNSET
    colors: Literal["parts", "people"] | UnsetType = UNSET
    opacity: Annotated[float, Meta(ge=0.1, le=1)] | UnsetType = UNSET
    cameras: bool | UnsetType = UNSET
    images: bool | UnsetType = UNSET
    floor: bool | UnsetType = UNSET
    gizmos: bool | UnsetType = UNSET
    ghost: bool | UnsetType = UNSET
    voxels: bool | UnsetType = UNSET
    character: Name | UnsetType = UNSET
    trail_points: Annotated[list[Name], Meta(max_length=1000)] | UnsetType = UNSET
    trail_frames: Annotated[int, Meta(ge=1, le=MAX_TRAIL_FRAMES)] | UnsetType = UNSET


class SetView3d(Command, frozen=True, tag="view_3d"):
    """Choose what the 3-D view shows; kept with the session."""

    changes: View3dChanges


class SetHeight(Command, frozen=True, tag="body_sizes"):
    """Scale the sizes being edited to another body height."""

    action: Literal["height"]
    person: Index
    height_m: _Metres


class SetPartSizes(Command, frozen=True, tag="body_sizes"):
    """Change sizes of a part, and of its counterpart on the other side if both sides are edited at once."""

    action: Literal["part"]
    person: Index
    part: Name
    length_m: _Metres | UnsetType = UNSET
    half_depth_m: _Metres | UnsetType = UNSET
    half_width_m: _Metres | UnsetType = UNSET


class SetGirdleWidth(Command, frozen=True, tag="body_sizes"):
    """Change the distance between the two shoulders or hips."""

    action: Literal["width"]
    person: Index
    girdle: Name
    width_m: _Metres


class CoupleSides(Command, frozen=True, tag="body_sizes"):
    """Edit both sides at once, or each on its own."""

    action: Literal["couple"]
    on: bool


class ApplySizes(Command, frozen=True, tag="body_sizes"):
    """Make the edited sizes those of the body, as one entry of the history."""

    action: Literal["apply"]
    person: Index
    refit: bool
    """Whether keyframes are fitted to the new body; otherwise they keep the sizes that they were made with."""


class ChangeBody(Command, frozen=True, tag="body_sizes"):
    """Move a person to another body, with the sizes that both have, as one entry of the history."""

    action: Literal["body"]
    person: Index
    to: Name
    """One of `bodies`."""


class DraftSizes(Command, frozen=True, tag="body_sizes"):
    """Discard the edited sizes, or edit those that the person had before the present ones."""

    action: Literal["discard", "previous"]
    person: Index


class AcquireSizes(Command, frozen=True, tag="acquire"):
    """Acquire the sizes of a person from the footage, or stop that."""

    action: Literal["start", "stop"]
    person: Index
    method: SizeMethod = "contours"
    """Evidence that sizes are fitted to: contours alone, or voxels first and then contours."""


class FindPeople(Command, frozen=True, tag="find_people"):
    """Find the people whom nobody has placed, acquire their sizes and track them, or stop that.

    `take` ends the search with the best poses so far, and goes on with them.
    """

    action: Literal["start", "stop", "take"]


InspectorCommand: TypeAlias = Union[  # noqa: UP007
    SetTrackSettings, SetView3d, SetHeight, SetPartSizes, SetGirdleWidth, CoupleSides, ApplySizes, ChangeBody,
    DraftSizes, AcquireSizes, FindPeople,
]  # fmt: skip


# --- to the page ----------------------------------------------------------------------------------------------------


class OptionInfo(Part, frozen=True):
    """An option of a tracking method."""

    name: str
    label: str
    help: str
    kind: OptionKind
    choices: dict[str, str]
    """Of a choice, the labels by value; else empty."""
    limits: tuple[float, float] | None
    """Of a number, its least and largest value; null where it is positive."""
    step: float
    default: bool | float | str | None


class MethodInfo(Part, frozen=True):
    """A tracking method."""

    name: str
    label: str
    help: str
    options: tuple[OptionInfo, ...]
    """In the order in which they are shown."""


class SearchValues(Part, frozen=True):
    """Settings of the search that hold for all stages."""

    theta_px: float | None
    """Distance beyond which an edge adds nothing more to the cost; null for 3% of the longer side of the image."""
    outliers: OutlierMode
    passes: tuple[float, ...]
    """Factors on the steps."""
    patience: int
    """Expansions without improvement after which a stage ends."""
    max_expansions: int
    limbs_apart: bool
    bound_rad: float
    bound_m: float
    step_rad: float
    step_m: float


class SettingsMessage(Message, frozen=True, tag="settings"):
    """Settings of tracker and search, and their defaults."""

    track: RunChoices
    search: SearchValues
    track_default: RunChoices
    search_default: SearchValues
    methods: tuple[MethodInfo, ...]
    """The tracking methods, the default first."""


class FloorInfo(Part, frozen=True):
    """The floor of the session."""

    up: str
    """World axis that points up."""
    tilt_deg: float | None
    """Angle between its normal and that axis; null for the floor of the calibration."""
    height_m: float | None
    """Its height; null for the floor of the calibration."""
    origin: str
    """Source of the plane, for display; empty for the floor of the calibration, and after a restart."""
    has_former: bool
    """Whether the floor before the last change can be restored."""


class View3dMessage(Message, frozen=True, tag="view_3d"):
    """Content of the 3-D view."""

    view: View3d
    floor: FloorInfo
    prediction: str
    """Origin of the predicted pose, or why there is none; empty while it is not shown."""
    trail_points: tuple[str, ...]
    """Names of the points whose trails can be shown."""
    characters: tuple[str, ...]
    """Names of the bodies that can move as each person does."""


class PartSizes(Part, frozen=True):
    """Sizes of one part of a body."""

    name: str
    length_m: float
    half_depth_m: float
    """Half its thickness from front to back."""
    half_width_m: float
    """Half its thickness from side to side."""


class GirdleWidth(Part, frozen=True):
    """Distance between the joints of the shoulders or hips."""

    name: str
    width_m: float


class BodySizesMessage(Message, frozen=True, tag="body_sizes"):
    """Body sizes of the person worked on: those being edited, otherwise the present ones."""

    person: int
    body: str
    """Name of the body."""
    bodies: tuple[str, ...]
    """Names of the built-in bodies."""
    height_m: float
    parts: tuple[PartSizes, ...]
    widths: tuple[GirdleWidth, ...]
    sides_alike: bool
    """Whether both sides are edited at once."""
    edited: bool
    """Whether these sizes are not applied yet."""
    has_former: bool
    """Whether the person had other sizes before."""
    outcome: str
    """Result of the last change, or empty."""
    height_limits_m: tuple[float, float]
    size_limits_m: tuple[float, float]
    """Least and largest length, distance, half depth or half width."""


class AcquisitionResult(Part, frozen=True):
    """An acquired body; its sizes are those being edited."""

    frames: tuple[int, ...]
    """Frames that the sizes were fitted to."""
    cost_before_px: float
    cost_after_px: float
    sizes: tuple[AcquiredSize, ...]
    """All sizes, those that changed most first."""
    size_px: tuple[int, int]
    """Width and height of the pictures."""
    front: SideOutlines
    side: SideOutlines


class AcquisitionMessage(Message, frozen=True, tag="acquisition"):
    """An acquisition of sizes from the footage: its progress, or its result."""

    person: int
    running: bool
    stage: str
    """The kind of work."""
    share: float
    """Share of the work that is done, 0 to 1."""
    message: str
    """Why there is no result, or what a result does not show; else empty."""
    result: AcquisitionResult | None


class SilhouetteAxes(Part, frozen=True):
    """The major axes of the silhouettes of people in one view."""

    camera: int
    people: tuple[tuple[tuple[float, float, float, float], ...], ...]
    """For each person the successive approximations x0, y0, x1, y1, undistorted px; the last is the axis."""


class FindingMessage(WorkMessage, frozen=True, tag="finding"):
    """The search for people whom nobody has placed: its progress, and who was found."""

    notes: tuple[str, ...]
    """Sentences on what was tried, then on who was found and how."""
    frame: int | None
    """The frame on which people were found last."""
    axes: tuple[SilhouetteAxes, ...]
    """The axes of the silhouettes on that frame, of each view that has some."""
