"""What the screen shows, as one frozen value. Only the controller makes a new one; the views read it."""

from dataclasses import dataclass, field, replace

import numpy as np

from app.state.floor_picking import FloorState
from app.state.view_3d import View3d
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.tracking.chamfer.settings import TrackSettings


@dataclass(frozen=True, eq=False)
class Shown:
    """One person on the frame that is shown."""

    values: Array
    """Pose, (n_values,)."""
    source: str | None
    """Who set it; None for a draft that is not stored: the pose of the nearest frame that has one."""
    status: str = ""
    """How good it is as its tracker judges: `good`, `doubtful`, `lost`, or empty."""
    remark: str = ""
    """What the tracker did on the frame, for people to read."""
    parts_px: tuple[float | None, ...] = ()
    """Cost of each part, px; None for an unseen part, empty where unknown."""
    sources: tuple[str, ...] = ()
    """Where each value of a pose that is not stored yet comes from, (n_values,); empty: all from `source`."""
    revision: int | None = None
    """The body model that a stored pose belongs to; None for one as it is not stored."""
    others: tuple[Array, ...] = ()
    """Poses that its tracker found about as good, (n_values,) each, best first; none where a person vouches for it."""


@dataclass(frozen=True)
class JobState:
    """The search that runs or stands on the shown frame."""

    running: bool = False
    kind: str | None = None
    """`search`, or None where none stands."""
    stage: str | None = None
    """Name of the stage at work."""
    stages: tuple[str, ...] = ()
    """Names of all stages, in order."""
    evaluations: int = 0
    """Poses scored since the search began."""
    per_second: float = 0.0
    """Poses scored per second of work."""
    best_px: float | None = None
    """Cost of the best pose so far, px."""
    candidate: tuple[Array, ...] | None = field(default=None, compare=False)
    """Pose of each person under test."""
    message: str = ""
    """How the last one ended."""


@dataclass(frozen=True, eq=False)
class ReplayState:
    """The recorded step of a search that is shown in place of the true poses."""

    run: int
    """Number of the run."""
    step: int
    """Index among its recorded steps; -1 for its start."""
    steps: int
    """How many are recorded."""
    candidate: tuple[Array, ...] | None
    """Pose of each person under test; None at the start."""
    best: tuple[Array, ...]
    """Best pose of each person by then."""
    stage: str | None
    """Name of the stage at work; None at the start."""
    candidate_px: float | None
    """Cost of the candidate, px."""
    best_px: float | None
    """Cost of the best, px."""
    best_views_px: tuple[float | None, ...]
    """The same in each view, px; empty where unknown."""
    evaluations: int
    """Poses scored by then."""


@dataclass(frozen=True, eq=False)
class Look:
    """How searches are watched: what is drawn of those that are over, and how fast one at work goes."""

    speed: float | None = None
    """Expansions per second; None for as many as there can be."""
    replay: ReplayState | None = None
    preview: tuple[Array, ...] | None = None
    """Poses that the pointer rests on in a list, drawn over the true ones."""
    compared: tuple[Array, ...] | None = None
    """Result of another run, drawn over the true poses."""
    compared_run: int | None = None
    """Number of that run."""


@dataclass(frozen=True, eq=False)
class Landscape:
    """The cost over the range of one degree of freedom, everything else as it was."""

    person: int
    dof: int
    """Index among the degrees of freedom of the person's body."""
    current: float
    """Its value in the pose, rad or metres."""
    current_px: float
    """Cost of the pose, px."""
    values: Array
    """Where the cost was taken, (N,), ascending, rad or metres."""
    totals_px: Array
    """Costs, (N,), px."""
    views_px: Array
    """Costs in each view, (N, V), px; NaN for views without edges."""


@dataclass(frozen=True)
class TrackState:
    """The tracking run that is at work or paused."""

    running: bool = False
    first: int | None = None
    """First frame of the run in the order of tracking; None where no run stands."""
    last: int | None = None
    """Last frame of the run; before `first` where it runs backward."""
    at: int | None = None
    """The frame tracked last; None before the first."""
    done: int = 0
    """Number of frames tracked."""
    total: int = 0
    """Number of frames to track."""
    per_second: float = 0.0
    """Frames tracked per second of work."""
    doubtful: int = 0
    """Number of frames called doubtful."""
    lost: int = 0
    """Number of frames called lost."""
    back: bool = False
    """Whether it is in its second pass, following back whoever was lost: `done` and `total` are of that."""
    message: str = ""
    """How the last run ended."""
    failed: bool = False
    """Whether it ended by an error."""


@dataclass(frozen=True)
class RangeState:
    """The work on a range of frames that is under way, or how the last one ended."""

    running: bool = False
    what: str = ""
    """What is being done, for people to read: `interpolating`."""
    done: int = 0
    """Number of frames written."""
    total: int = 0
    """Number of frames to write."""
    message: str = ""
    """How the last one ended."""


@dataclass(frozen=True)
class FootageState:
    """How far the frames of the videos have been listed, which the first opening of long footage does beside."""

    listed: float | None = None
    """Share of the footage, 0 to 1; None when all of it is."""
    error: str | None = None
    """What was wrong with a file; None where nothing was."""


@dataclass(frozen=True)
class DragState:
    """A hand on a point."""

    camera: int
    person: int
    point: str
    """Name of the point, or of the part where that is held by its surface."""
    pointer_px: tuple[float, float]
    """Undistorted px."""
    part: int
    """Index of the part that carries the held place."""
    place_part: tuple[float, float, float]
    """The held place in the frame of its part, metres."""
    by_surface: bool = False
    """Whether the part is held by its surface, not by a point."""
    mode: str = "move"
    """`move`, `turn` or `push`, see `tracker.posing.drag`."""


@dataclass(frozen=True, eq=False)
class SizeDraft:
    """Sizes of a person's body that are being edited and not applied yet."""

    person: int
    model: BodyModel
    """The body as it would be."""


@dataclass(frozen=True)
class Cast:
    """Whom the views show, and how. It changes no pose: who is not shown still hides others, and counts in costs."""

    hidden: frozenset[int] = frozenset()
    """Indices of the people whom no view shows."""
    solo: bool = False
    """Whether everybody but the person worked on is dimmed, and out of reach of a hand."""


@dataclass(frozen=True, eq=False)
class State:
    """Everything the views need, and nothing they could derive."""

    frame: int
    people: tuple[Shown, ...]
    models: tuple[BodyModel, ...] = ()
    """The body in which each person is shown: the one that a stored pose was made with, else the present one."""
    revisions: tuple[int, ...] = ()
    """What the store calls each of these bodies."""
    present: tuple[int, ...] = ()
    """What it calls the present body of each person, which new poses are made with."""
    draft: SizeDraft | None = None
    """Sizes being edited."""
    sides_alike: bool = True
    """Whether sizes are edited on both sides at once."""
    sizes_message: str = ""
    """What came of the last change of sizes."""
    person: int = 0
    """Index of the person worked on."""
    point: str | None = None
    """The point last touched."""
    cast: Cast = field(default_factory=Cast)
    cost_px: float | None = None
    """Mean over the views, px; None while the frame's evidence is not there yet."""
    view_costs_px: tuple[float | None, ...] = ()
    """Cost of each view, px; None for a view without edges."""
    job: JobState = field(default_factory=JobState)
    look: Look = field(default_factory=Look)
    landscape: Landscape | None = None
    """Of the pose shown or one shortly before; None until a page looks at it."""
    track: TrackState = field(default_factory=TrackState)
    follow: bool = True
    """Whether the frame that is being tracked is shown, or the user looks around meanwhile."""
    locked: tuple[frozenset[int], ...] = ()
    """Of each person the degrees of freedom that neither hand nor search nor fit moves, by index."""
    ranges: RangeState = field(default_factory=RangeState)
    disagreeing: tuple[int, ...] = ()
    """Frames whose poses do not go together with those around them, ascending (see `tracker.motion.consistency`)."""
    pins: tuple[tuple[PointObservation, ...], ...] = ()
    """The pins of each person on the frame, by point and camera."""
    holds_pin: bool = False
    """Whether a hand holds a pin."""
    drag: DragState | None = None
    drag_seqs: tuple[tuple[int, int], ...] = ()
    """For each page that drags: its number, and the last of its drag messages that this state takes in."""
    holding_3d: frozenset[int] = frozenset()
    """Numbers of the pages that draw the 3-D view without a graphics card, and want it to rest during a drag."""
    view_3d: View3d = field(default_factory=View3d)
    floor: FloorState = field(default_factory=FloorState)
    footage: FootageState = field(default_factory=FootageState)
    compiling: bool = False
    """Whether kernels are being compiled beside the page."""
    snapped: int | None = None
    """The camera through which the 3-D view looks, by index; None where it is free."""
    settings: TrackSettings = field(default_factory=TrackSettings)
    """What searches and trackers are told."""
    undo: str | None = None
    """What undo would take back."""
    redo: str | None = None
    save_error: str | None = None
    """Why the last edit is not on disk; None where all is saved."""
    timeline_version: int = 0
    """Rises whenever the stored poses change."""

    @property
    def rests_3d(self) -> bool:
        """Whether the 3-D view and its panels wait for the end of a drag."""
        return self.in_hand and bool(self.holding_3d)

    @property
    def spares_3d(self) -> bool:
        """Whether the 3-D view and its panels are drawn but once in a while: who is at work needs the processor."""
        return (self.track.running or self.job.running) and bool(self.holding_3d)

    @property
    def in_hand(self) -> bool:
        """Whether a gesture is at hand, which changes the state many times a second."""
        return self.drag is not None or self.holds_pin

    @property
    def drawn(self) -> "State":
        """What the views draw: this state, or where a search is replayed, the poses and costs of the step replayed."""
        replayed = self.look.replay
        if replayed is None:
            return self
        people = tuple(Shown(best, "searched") for best in replayed.best)
        job = replace(self.job, candidate=replayed.candidate)
        return replace(
            self, people=people, job=job, cost_px=replayed.best_px, view_costs_px=replayed.best_views_px, drag=None
        )

    @property
    def poses(self) -> tuple[Array, ...]:
        """Pose of each person, (n_values,) each."""
        return tuple(p.values for p in self.people)


def finite_or_none(value: float) -> float | None:
    """None where a number is NaN or infinite, as JSON wants it."""
    return float(value) if np.isfinite(value) else None
