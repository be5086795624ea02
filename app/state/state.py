"""The state of an open session, as one frozen value. Only the controller makes a new one; the views read it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Concatenate, ParamSpec

import numpy as np

from app.state.annotation import AnnotationState
from app.state.calibration import CalibrationState, ClocksState
from app.state.comparison import PoseComparison, RangeComparison
from app.state.floor_picking import FloorState
from app.state.observations import ObservationsState
from app.state.other_copy import OtherCopy
from app.state.people import (
    AcquisitionState,
    DepthNote,
    DragState,
    HeldPoint,
    KeyframeDoubt,
    ShownPose,
    SizeDraft,
    Visibility,
)
from app.state.progress import FindState, FootageState, PoseWork, RangeState, TrackState
from app.state.reason import Reason, ReasonState
from app.state.run_choices import RunChoices
from app.state.search import CostLandscape, CostMap, SearchState, SearchView
from app.state.view_3d import View3d
from tracker.body.model import BodyModel
from tracker.compute.kernel_cache import STAGES
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.session.store.records import ALL_FRAMES

P = ParamSpec("P")


@dataclass(frozen=True, eq=False, kw_only=True)
class ShownFrame:
    """The people of the shown frame, as they are stored or changed."""

    frame: int = 0
    people: tuple[ShownPose, ...] = ()
    models: tuple[BodyModel, ...] = ()
    """The body in which each person is shown: that of the stored pose, else the present one."""
    revisions: tuple[int, ...] = ()
    """Model revision of each of these bodies."""
    present: tuple[int, ...] = ()
    """Revision of each person's present body, which new poses are made with."""
    velocities: tuple[Array | None, ...] = ()
    """Change of each person's pose from one frame to the next, (n_dofs,), by the stored poses around the frame; None
    without any, and empty where all cameras share one clock."""
    pins: tuple[tuple[PointObservation, ...], ...] = ()
    """The pins of each person on the frame, by point and camera."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Costs:
    """The costs of the shown poses."""

    cost_px: float | None = None
    """Mean over the views, px; None until the frame's evidence is computed."""
    view_costs_px: tuple[float | None, ...] = ()
    """Cost of each view, px; None for a view without edges."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ViewPart:
    """Selection, and how the people are looked at."""

    person: int = 0
    """Index of the selected person."""
    point: str | None = None
    """The selected point."""
    visibility: Visibility = field(default_factory=Visibility)
    follow: bool = True
    """Whether each frame is shown as it is tracked."""
    snapped: int | None = None
    """Index of the camera through which the 3-D view looks; None for a free view."""
    view_3d: View3d = field(default_factory=View3d)
    prediction_note: str = ""
    """Origin of the predicted pose in the 3-D view, or why there is none; empty while it is not shown."""
    pages_pausing_3d: frozenset[int] = frozenset()
    """Numbers of the pages that render the 3-D view in software and pause it during a drag."""
    pages_blurring_faces: frozenset[int] = frozenset()
    """Numbers of the pages that blur faces: pictures in the 3-D view, which is one for all, are blurred if one does."""


@dataclass(frozen=True, eq=False, kw_only=True)
class EditPart:
    """Work by hand: drags, pins, locks, body sizes, the floor."""

    drag: DragState | None = None
    drag_seqs: tuple[tuple[int, int], ...] = ()
    """For each page that drags: its number, and the sequence number of its last applied drag message."""
    is_pin_held: bool = False
    """Whether a pin is being dragged."""
    held: frozenset[HeldPoint] = frozenset()
    """Points that stay in place during drags, on all frames; until the program ends or they are released."""
    depth_note: DepthNote | None = None
    """The last placement whose depth no view has shown; see `undetermined_depth`."""
    locked: tuple[frozenset[int], ...] = ()
    """Indices of the locked degrees of freedom of each person."""
    draft: SizeDraft | None = None
    """Sizes being edited."""
    sides_alike: bool = True
    """Whether sizes are edited on both sides at once."""
    sizes_message: str = ""
    """Result of the last change of sizes."""
    floor: FloorState = field(default_factory=FloorState)


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchPart:
    """Searches of the shown frame, the costs around its pose, and what they changed."""

    settings: TrackSettings = field(default_factory=TrackSettings)
    """Settings of searches and trackers."""
    search: SearchState = field(default_factory=SearchState)
    search_view: SearchView = field(default_factory=SearchView)
    comparison: PoseComparison | None = None
    """The last fit or search of any frame; see `compared`."""
    landscape: CostLandscape | None = None
    """Of the shown pose or one shortly before; None until a page displays it."""
    cost_map: CostMap | None = None
    """Of the shown pose or one shortly before; None until a page displays it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RunPart:
    """Work on many frames and on the cameras."""

    run_choices: RunChoices = field(default_factory=RunChoices)
    """Method, frames and cameras of the next tracking run."""
    track: TrackState = field(default_factory=TrackState)
    finding: FindState = field(default_factory=FindState)
    """Search for people whom nobody has placed."""
    acquisition: AcquisitionState = field(default_factory=AcquisitionState)
    """Acquisition of sizes from the footage."""
    ranges: RangeState = field(default_factory=RangeState)
    range_comparison: RangeComparison | None = None
    """The poses of a range against those that they replaced; None while nothing is compared."""
    calibration: CalibrationState = field(default_factory=CalibrationState)
    """Check of the cameras."""
    clocks: ClocksState = field(default_factory=ClocksState)
    observations: ObservationsState = field(default_factory=ObservationsState)
    """Imported observations."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ReviewPart:
    """The plan of annotation, other copies, and doubts about poses."""

    annotation: AnnotationState = field(default_factory=AnnotationState)
    """The plan of annotation, comments, and the next best click."""
    other_copy: OtherCopy | None = None
    """The copy of the session that is compared with it."""
    checked: frozenset[tuple[int, int]] = frozenset()
    """Index of the person and frame of the poses that are being assessed."""
    reasons: ReasonState = field(default_factory=ReasonState)
    """Why the shown pose is in doubt, as far as a page asks."""
    inconsistent_frames: tuple[int, ...] = ()
    """Frames whose poses disagree with their neighbours, ascending (see `tracker.body.motion.keyframe_doubts`)."""
    keyframe_doubts: tuple[KeyframeDoubt, ...] = ()
    """Keyframes that their neighbours or views contradict, by person and frame."""


@dataclass(frozen=True, eq=False, kw_only=True)
class StoragePart:
    """Disk, history, footage and kernels."""

    undo: str | None = None
    """Label of the edit that undo would revert."""
    redo: str | None = None
    saved: bool = True
    """Whether every pose and pin that has been shown as set is on disk; drafts are not."""
    save_error: str | None = None
    """Why the last edit is not on disk; None if none has failed."""
    timeline_version: int = 0
    """Increases with every change of the stored poses."""
    footage: FootageState = field(default_factory=FootageState)
    compiled: frozenset[str] = frozenset(STAGES)
    """Groups of kernels that can be called without delay; see `tracker.compute.kernel_cache`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class State(ShownFrame, Costs, ViewPart, EditPart, SearchPart, RunPart, ReviewPart, StoragePart):
    """Everything that the views need and cannot derive."""

    @property
    def is_3d_paused(self) -> bool:
        """Whether the 3-D view waits for the end of a drag."""
        return self.is_dragging and bool(self.pages_pausing_3d)

    @property
    def is_3d_throttled(self) -> bool:
        """Whether the 3-D view is drawn rarely, to leave the processor to a running job."""
        return (self.track.running or self.search.running) and bool(self.pages_pausing_3d)

    @property
    def pose_work(self) -> PoseWork | None:
        """The work on poses that changes them now; None for none."""
        track = self.track
        if self.drag is not None:
            return PoseWork(f"drags on frame {self.frame}", frozenset({self.drag.person}), {self.frame})
        if self.is_pin_held:
            return PoseWork(f"sets a pin on frame {self.frame}", frozenset({self.person}), {self.frame})
        if self.search.running:
            return PoseWork(f"searches frame {self.frame}", None, {self.frame})
        if track.running and track.first is not None and track.last is not None:
            first, last = sorted((track.first, track.last))
            return PoseWork(f"tracks frames {first} to {last}", None, range(first, last + 1))
        if self.ranges.frames:
            what, people, frames = self.ranges.what, self.ranges.people, self.ranges.frames
            return PoseWork(f"is {what} frames {frames[0]} to {frames[-1]}", people, frames)
        if self.finding.running:
            return PoseWork("finds people", None, ALL_FRAMES)
        return None

    @property
    def compiling(self) -> str | None:
        """The group of kernels being compiled; None once all are compiled."""
        return next((stage for stage in STAGES if stage not in self.compiled), None)

    @property
    def is_dragging(self) -> bool:
        """Whether a gesture changes the state many times a second."""
        return self.drag is not None or self.is_pin_held

    @property
    def compared(self) -> PoseComparison | None:
        """The last fit or search, if its result is shown unchanged; None otherwise."""
        last = self.comparison
        if last is None or (last.frame, last.revisions) != (self.frame, self.revisions):
            return None
        pairs = zip(self.people, last.after, strict=True)
        return last if all(p.values is v or np.array_equal(p.values, v) for p, v in pairs) else None

    @property
    def reason(self) -> Reason | None:
        """The reason for the shown pose of the selected person, if it is made and the pose is shown unchanged."""
        last = self.reasons.found
        if last is None or (last.frame, last.person) != (self.frame, self.person):
            return None
        return last if self.people[last.person].values is last.values else None

    @property
    def undetermined_depth(self) -> DepthNote | None:
        """The last placement whose depth no view has shown, if its pose is shown unchanged; None otherwise."""
        last = self.depth_note
        if last is None or last.frame != self.frame or self.is_dragging:
            return None
        return last if self.people[last.person].values is last.values else None

    @property
    def drawn(self) -> "State":
        """The state to draw: this one, the replayed step of a search, or the poses before the last fit or search."""
        replayed = self.search_view.replay
        if replayed is not None:
            people = tuple(ShownPose(best, "searched") for best in replayed.best)
            search = replace(self.search, candidate=replayed.candidate)
            return replace(
                self, people=people, search=search, drag=None,
                cost_px=replayed.cost_px, view_costs_px=replayed.view_costs_px,
            )  # fmt: skip
        compared = self.compared
        if compared is not None and compared.is_before_shown:
            return replace(
                self, people=compared.before, drag=None,
                cost_px=compared.before_px, view_costs_px=compared.before_view_costs_px,
            )  # fmt: skip
        return self

    @property
    def people_not_drawn(self) -> frozenset[int]:
        """Indices of the people whom no view draws: hidden ones, and those who are sought and have no pose yet."""
        unplaced = (i for i in self.finding.sought if self.people[i].source is None)
        return self.visibility.hidden.union(unplaced)

    @property
    def is_stored_drawn(self) -> bool:
        """Whether the views show the poses that an edit would change."""
        compared = self.compared
        return self.search_view.replay is None and (compared is None or not compared.is_before_shown)

    def held_points(self, person: int) -> frozenset[str]:
        """Return the names of the points of a person, given by index, that are held on the shown frame."""
        return frozenset(h.point for h in self.held if (h.frame, h.person) == (self.frame, person))

    def velocity(self, person: int) -> Array | None:
        """Return the velocity of a person, given by index, if it is known and needed."""
        return self.velocities[person] if self.velocities else None

    @property
    def poses(self) -> tuple[Array, ...]:
        """Pose of each person, (n_values,) each."""
        return tuple(p.values for p in self.people)


def takes_changes_of(
    value: Callable[P, object],
) -> Callable[[Callable[..., None]], Callable[Concatenate[Any, P], None]]:
    """Declare that the keywords of a method are fields of a value, with their types."""
    return lambda method: method


def finite_or_none(value: float) -> float | None:
    """None where a number is NaN or infinite, as JSON wants it."""
    return float(value) if np.isfinite(value) else None
