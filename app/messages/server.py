"""Text messages from the program to the page: the one declaration of their types and fields.

Messages about searches and poses that deserve a look are in `search`, the inspector's in `inspector`. `encoding` and
the feeds make them. `tests/recipes/protocol_docs.py` writes the page's types and docs/protocol.md from them.
"""

from typing import Literal, TypeAlias, Union, get_args

from app.drawing.epipolar_check import EpipolarDistance, EpipolarLine
from app.messages import inspector, search
from app.messages.advice import AdviceMessage
from app.messages.annotation import AnnotationMessage, PresenceMessage
from app.messages.base import Message, Part, Status
from app.messages.cameras import CalibrationMessage, ClocksMessage
from app.messages.observation import AnnotatorsMessage, ObservationsMessage, OtherCopyMessage, ProvenanceMessage
from app.state.comparison import ComparedWork
from app.state.progress import TrackStage
from app.state.role import Role

# --- session -------------------------------------------------------------------------------------------------------


class CameraInfo(Part, frozen=True):
    """A camera."""

    name: str
    width: int
    """Pixels."""
    height: int
    """Pixels."""


class DofInfo(Part, frozen=True):
    """A degree of freedom."""

    joint: str
    name: str
    """Name within the joint."""
    unit: Literal["deg", "cm"]
    low: float | None
    """Lower limit; null where there is none."""
    high: float | None
    """Upper limit; null where there is none."""


class Limb(Part, frozen=True):
    """The limb that a point belongs to."""

    name: str
    dofs: tuple[int, ...]
    """Indices of its degrees of freedom."""


class PersonInfo(Part, frozen=True):
    """A person."""

    name: str
    color: str
    """`#rrggbb`."""
    model: str
    """Name of the body model."""
    height_m: float
    points: tuple[str, ...]
    """Names of the joints and landmarks."""
    minor: tuple[str, ...]
    """Points that give way to others where they crowd."""
    heading: tuple[str, ...]
    """Points that turn the body about the vertical: shoulders and hips."""
    bones: tuple[tuple[str, str], ...]
    """Pairs of points that the stick figure connects."""
    parts: tuple[str, ...]
    """Names of the body parts."""
    limbs: tuple[str, ...]
    """Names of the limbs that are assessed, for display."""
    dofs: tuple[DofInfo, ...]
    point_dofs: dict[str, tuple[int, ...]]
    """By point: the degrees of freedom of its joint, by index."""
    point_limbs: dict[str, Limb]
    """By point: its limb."""


class SessionMessage(Message, frozen=True, tag="session"):
    """The session; the first message on each connection."""

    name: str
    fps: float
    n_frames: int
    cameras: tuple[CameraInfo, ...]
    people: tuple[PersonInfo, ...]
    doubtful_from: float
    """A limb that is lost with a higher probability is doubtful."""
    lost_from: float
    """A limb that is lost with a higher probability counts as lost."""
    start: str
    """Identifies the start of the program. After another start a page goes back to the frame and person it showed."""
    role: Role
    """Messages that the page may send; others are refused."""
    has_place: bool
    """Whether the page has a frame of its own; else it shows that of the host."""
    has_outlines: bool
    """Whether some camera has a background or masks; else only what moves shows the people."""


# --- state ---------------------------------------------------------------------------------------------------------


class PersonState(Part, frozen=True):
    """A person on the shown frame."""

    source: str | None
    """Origin of the stored pose; null where there is none."""
    status: Status
    shown: bool
    """False for a hidden person."""
    alternatives: int
    """Number of poses that the tracker found about as good."""


class Job(Part, frozen=True):
    """The search of the shown frame. A paused search has a `kind` and is not running."""

    running: bool
    kind: str | None
    """Null where there is no search."""
    stage: str | None
    """The stage that is searched."""
    evaluations: int
    """Poses scored."""
    message: str
    """Result of the last search, or empty."""


class Track(Part, frozen=True):
    """The tracking run. A paused run has a `first` and is not running."""

    running: bool
    first: int | None
    """First frame; null where there is no run."""
    last: int | None
    """Last frame."""
    at: int | None
    """The frame tracked last."""
    done: int
    """Frames tracked, of the current pass."""
    total: int
    """Frames to track, of the current pass."""
    stage: TrackStage
    """Stage of the run: forward, backward, or all frames together."""
    message: str
    """Result of the last run, or empty."""


class RangeWork(Part, frozen=True):
    """The work on a range of frames."""

    running: bool
    what: str
    """For people to read: `interpolating`."""
    done: int
    """Frames written."""
    total: int
    """Frames to write."""
    message: str
    """Result of the last work, or empty."""


class ReplayedStep(Part, frozen=True):
    """The recorded step that is shown in place of the stored poses."""

    run: int
    step: int
    """-1 for the start."""
    steps: int
    """Recorded steps of the run."""
    stage: str | None


class PreviewedCandidate(Part, frozen=True):
    """The candidate of a search that is drawn over the views."""

    run: int
    candidate: int
    """Index among the best candidates of the run."""


class Compared(Part, frozen=True):
    """The last fit or search, while its result is shown unchanged."""

    number: int
    """Differs between fits and searches; a search that continues keeps it."""
    work: ComparedWork
    before_px: float | None
    """Mean cost before."""
    after_px: float | None
    before_view_costs_px: tuple[float | None, ...]
    """By camera; empty where unknown."""
    after_view_costs_px: tuple[float | None, ...]
    warning: str
    """Sentence on a large disagreement of the edges with the user's placement; empty without one."""
    is_before_shown: bool
    """Whether the views show the poses before. The costs and handles are theirs then, and no joint can be dragged."""


class FloorPicking(Part, frozen=True):
    """Progress of setting the floor."""

    point: int
    """Number of the current point, from 1."""
    views: int
    """Number of views in which it is marked."""
    marked: bool
    """Whether any point is marked anywhere."""
    known: bool
    """Whether the current point is triangulated."""
    error_px: float | None
    """Largest distance of a mark from the image of the triangulated point."""
    ready: bool
    """Whether there is a plane to apply."""
    why: str
    """Why there is none."""


class StateMessage(Message, frozen=True, tag="state"):
    """Texts and figures of the page, whenever any changed; during a drag or a search at most 5 times per second."""

    frame: int
    person: int
    """The person worked on."""
    point: str | None
    """The point last touched."""
    people: tuple[PersonState, ...]
    solo: bool
    """Whether everybody but the person worked on is dimmed."""
    cost_px: float | None
    """Mean over the views."""
    view_costs_px: tuple[float | None, ...]
    """By camera."""
    source: str | None
    """Origin of the pose of the person worked on: `manual`, `pinned`, `searched`, `fitted`, `tracked`, ..."""
    status: Status
    remark: str
    """Note of the tracker about this frame."""
    is_checked: bool
    """Whether the pose is being assessed."""
    part_costs_px: tuple[float | None, ...]
    """By part; null for an unseen one, empty where unknown."""
    expected_errors_m: tuple[float, ...]
    """Of each point of the person worked on, root mean square; empty where unknown."""
    dofs: tuple[float, ...]
    """Degrees of freedom of the person worked on, degrees and centimetres."""
    locked: tuple[int, ...]
    """Indices of the locked ones."""
    other_sizes: bool
    """Whether the pose belongs to a former revision of the body, and is drawn with it."""
    job: Job
    replay: ReplayedStep | None
    """While one is shown, the costs are those of the step, and the overlay shows its best and its candidate."""
    compared_run: int | None
    """Number of the run whose result is drawn."""
    preview: PreviewedCandidate | None
    compared: Compared | None
    """Null where there is no such result, or it has changed."""
    view_across: int | None
    """The view that would show the depth of the last placed point; null where the views have shown it, or the pose has
    changed since."""
    track: Track
    range: RangeWork
    follow: bool
    """Whether each frame is shown as it is tracked."""
    snapped: int | None
    """The camera that the 3-D view looks through."""
    floor: FloorPicking | None
    """Null while nobody sets the floor."""
    compiling: str | None
    """Group of kernels being compiled, as after an installation."""
    undo: str | None
    """Label of the entry that undo would undo."""
    redo: str | None
    """Label of the entry that redo would redo."""
    saved: bool
    """Whether every pose and pin shown so far is on disk, also those of frames that a running tracker has left."""
    save_error: str | None
    """Why an edit could not be written; null if none waits."""


# --- other text messages -------------------------------------------------------------------------------------------


class HistoryEntry(Part, frozen=True):
    """An edit that undo or redo can reach."""

    edit: int
    label: str
    author: str
    time: str
    """ISO 8601, UTC."""
    undone: bool
    """Whether redo would redo it."""


class HistoryMessage(Message, frozen=True, tag="history"):
    """The history, whenever it changed; only for subscribed pages."""

    entries: tuple[HistoryEntry, ...]
    """Latest first. The first that is not `undone` is the present one."""
    later: bool
    """Whether there are more undone entries than requested."""
    earlier: bool
    """Whether there are more done entries than requested."""


class NoticeMessage(Message, frozen=True, tag="notice"):
    """One sentence for the user."""

    level: Literal["error", "info"]
    text: str


class Cell(Part, frozen=True):
    """A frame with a pose."""

    source: str
    cost_px: float | None
    keyframe: bool
    status: Status
    remark: str
    reviewed: bool
    ambiguous: bool
    """Whether there is an alternative, and nobody has confirmed the pose."""
    limbs_lost: tuple[float, ...]
    """Probability that each of the person's `limbs` is lost; empty for good poses, unknown ones and several people."""


class TimelineMessage(Message, frozen=True, tag="timeline"):
    """Cells of the timeline that changed, by frame; null removes one. One message for all people, then one for each."""

    person: int | None
    """Null for all people together: the worst of each frame, reviewed if all are."""
    cells: dict[str, Cell | None]
    replace: bool
    """Whether all other frames have no pose."""


class DofObservability(Part, frozen=True):
    """How well the views constrain a degree of freedom."""

    level: Literal["known", "weak", "unknown"]
    """`weak` where the standard deviation is more than half of what counts as observable."""
    sigma: float
    """Standard deviation in the unit of the degree of freedom, degrees or centimetres."""
    sentence: str


class ObservabilityMessage(Message, frozen=True, tag="observability"):
    """How well the views constrain the pose of the selected person; only for pages that show the layer of this name."""

    frame: int
    person: int
    dofs: tuple[DofObservability, ...]
    """In the order of the person's degrees of freedom; empty where the person has no pose."""


class EpipolarMessage(Message, frozen=True, tag="epipolar"):
    """The line of sight of a pixel in the other views; only for the page that asks for it."""

    lines: tuple[EpipolarLine, ...]
    distance: EpipolarDistance | None
    """Of the other pixel; null without one, or where its view does not show the line."""


TextMessage: TypeAlias = Union[  # noqa: UP007
    SessionMessage, StateMessage, AdviceMessage, HistoryMessage, NoticeMessage, TimelineMessage,
    search.InconsistentMessage, search.RangeComparisonMessage, ObservabilityMessage, EpipolarMessage,
    search.SearchSetupMessage, search.SearchRunsMessage, inspector.SettingsMessage, inspector.View3dMessage,
    inspector.BodySizesMessage, inspector.AcquisitionMessage, inspector.FindingMessage, CalibrationMessage,
    ClocksMessage, ObservationsMessage, search.ReasonMessage, search.CostMapMessage, AnnotationMessage,
    PresenceMessage, ProvenanceMessage, AnnotatorsMessage, OtherCopyMessage,
]  # fmt: skip

TEXT_MESSAGES: tuple[type[Message], ...] = get_args(TextMessage)
