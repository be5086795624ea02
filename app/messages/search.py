"""Messages about searches, and about poses that deserve a look, as `base` explains."""

from typing import Annotated, Literal, TypeAlias, Union

import msgspec
from msgspec import UNSET, Meta, UnsetType

from app.control.search.search_settings import SearchLeaf
from app.messages.base import MAX_INT, Command, Index, Message, Name, Number, Part
from app.state.comparison import ComparedPose, Stretch

OutlierMode: TypeAlias = Literal["truncated", "paper"]
RunState: TypeAlias = Literal["running", "paused", "over"]


# --- from the page --------------------------------------------------------------------------------------------------


class RunSearch(Command, frozen=True, tag="search"):
    """Search the shown frame: one expansion, to the end of the stage, or the whole frame; fit its contours, the whole
    body at once or chain by chain; or stop.

    A search of other people than the current one starts from the beginning.
    """

    action: Literal["step", "stage", "frame", "contours", "chains", "stop"]
    person: Index | None = None
    """The only person to search; null for everybody."""


class RepeatSearch(Command, frozen=True, tag="search"):
    """Search again from the start of a run of this frame, with the present settings."""

    action: Literal["again"]
    run: Index | None = None
    """Number of the run; null for the newest."""
    person: Index | None = None
    """The only person to search; null for everybody."""


class SetSearchSpeed(Command, frozen=True, tag="search_speed"):
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


class SetSearchSettings(Command, frozen=True, tag="search_settings"):
    """Change settings of the search."""

    changes: SearchChanges


class ReplayStep(Command, frozen=True, tag="replay"):
    """Show a recorded step of a search in place of the stored poses."""

    run: Index | None
    """Number of the run; null shows the stored poses again."""
    step: Annotated[int, Meta(ge=-1, le=MAX_INT)] = -1
    """Index of the step; -1 for the start."""


class CompareRun(Command, frozen=True, tag="compare"):
    """Draw the result of a run over the views; null draws none."""

    run: Index | None


class PreviewCandidate(Command, frozen=True, tag="preview"):
    """Draw a candidate of a run over the views; null draws none."""

    run: Index
    candidate: Index | None


class TakeCandidate(Command, frozen=True, tag="take"):
    """Take over a candidate of a run as an edit; null for the run's result."""

    run: Index
    candidate: Index | None


class ShowLandscape(Command, frozen=True, tag="landscape"):
    """Choose the degree of freedom of the person worked on whose cost landscape is shown."""

    dof: Name


class SetLandscapeDof(Command, frozen=True, tag="landscape_set"):
    """Set a degree of freedom to a value of its landscape, as an edit."""

    person: Index
    dof: Index
    value: Number
    """Radians or metres."""


class ShowCostMap(Command, frozen=True, tag="cost_map"):
    """Subscribe to the cost over two degrees of freedom around the shown pose; null unsubscribes."""

    person: Index
    dofs: tuple[Index, Index] | None
    """The horizontal one first."""


class SetCostMapPlace(Command, frozen=True, tag="cost_map_set"):
    """Set two degrees of freedom to a place of their cost map, as an edit."""

    person: Index
    dofs: tuple[Index, Index]
    values: tuple[Number, Number]
    """Degrees or centimetres."""


class AskReason(Command, frozen=True, tag="reason"):
    """Subscribe to the reason for the shown pose, or no longer; or stop the work on it until somebody asks again."""

    action: Literal["ask", "leave", "stop"]


SearchCommand: TypeAlias = Union[  # noqa: UP007
    RunSearch, RepeatSearch, SetSearchSpeed, SetSearchSettings, ReplayStep, CompareRun, PreviewCandidate,
    TakeCandidate, ShowLandscape, SetLandscapeDof, ShowCostMap, SetCostMapPlace, AskReason,
]  # fmt: skip


# --- to the page ----------------------------------------------------------------------------------------------------


class SearchSetupMessage(Message, frozen=True, tag="search_setup"):
    """The decomposition of the search, in its order, and the speed; only for pages that watch searches."""

    speed: float | None
    """Expansions per second; null for no limit."""
    leaves: tuple[SearchLeaf, ...]


class SearchStage(Part, frozen=True):
    """A stage of a run."""

    person: int
    name: str
    factor: float
    """Factor on the steps."""
    evaluations: int
    gain_px: float
    """Decrease of the cost."""
    done: bool
    running: bool


class SearchRun(Part, frozen=True):
    """A search of the shown frame."""

    number: int
    state: RunState
    start_px: float | None
    """Cost at the start."""
    best_px: float | None
    """Least cost."""
    evaluations: int
    seconds: float
    """Time of work."""
    steps: int
    """Recorded steps."""
    thinned: int
    """How often recorded steps were thinned, to stay below 10,000."""
    differs: dict[str, str]
    """Settings that are not the same in all runs, by label."""
    stages: tuple[SearchStage, ...]


class Replay(Part, frozen=True):
    """The recorded step that is shown."""

    run: int
    step: int
    stage: str | None
    candidate_px: float | None
    """Cost of the candidate."""
    best_px: float | None
    """Least cost until then."""
    evaluations: int


class SearchRunsMessage(Message, frozen=True, tag="search_runs"):
    """Runs of the shown frame, oldest first; only for pages that watch searches."""

    runs: tuple[SearchRun, ...]
    replay: Replay | None
    compared: int | None
    """Number of the run whose result is drawn."""


class RangeComparisonMessage(Message, frozen=True, tag="range_comparison"):
    """The poses of a range against those that they replaced."""

    first: int | None
    """Null while nothing is compared."""
    last: int | None
    people: tuple[tuple[ComparedPose, ...], ...]
    """By person; frames whose pose replaced none are left out."""
    stretches: tuple[Stretch, ...]
    """Frames on which the present poses are better or worse, by person; of a run as they were at its end."""
    run: int | None
    """Number of the tracking run that has just replaced the poses; null for another range."""


# --- poses that deserve a look --------------------------------------------------------------------------------------


class RaisedViewCost(Part, frozen=True):
    """A view whose cost contradicts a keyframe."""

    camera: int
    cost_px: float
    usual_px: float
    """Median over the frames around the keyframe."""


class KeyframeDoubt(Part, frozen=True):
    """A keyframe that its neighbours or views contradict, or tracks that have not seen it."""

    person: int
    frame: int
    distance_cm: float | None
    """Distance from the motion of its neighbours; null if they agree with it."""
    point: str
    """Name of the farthest point, for display; empty if they agree."""
    views: tuple[RaisedViewCost, ...]
    """Most raised first."""
    reason: str
    """Why a run or an audit finds it doubtful or lost; empty if none does."""


class InconsistentMessage(Message, frozen=True, tag="inconsistent"):
    """Frames whose pose does not agree with the motion around it (`tracker/body/motion/keyframe_doubts.py`)."""

    frames: tuple[int, ...]
    """All of them, ascending. A doubted keyframe stands for its neighbours."""
    keyframes: tuple[KeyframeDoubt, ...]
    """By person and frame."""


class PartReason(Part, frozen=True):
    """Measures of a part in each view. Tuples are by camera; null where it does not show the part, or not that."""

    below_nats: tuple[float | None, ...]
    """Evidence of the part's colours below the usual of the run; negative where it is above."""
    outside: tuple[float | None, ...]
    """Share of the part outside the silhouette, 0 to 1."""
    usual_outside: tuple[float | None, ...]
    """Median over the run."""
    contour_px: tuple[float | None, ...]
    """Mean distance of the part's contour to the edges."""
    usual_contour_px: tuple[float | None, ...]
    """Median over the run."""
    below_in_all_nats: float
    """Of all views together, which a hidden part is below, too."""


class LimbReason(Part, frozen=True):
    """A limb and its parts."""

    name: str
    """For display: `left arm`; the trunk holds the parts of no limb."""
    parts: tuple[int, ...]
    """Indices of its parts, from the trunk outwards."""


class GhostPose(Part, frozen=True):
    """Another pose of the person, drawn as a ghost."""

    nats: float
    """How much more it costs than the shown pose; negative if it is better."""
    limbs: tuple[str, ...]
    """Limbs that are elsewhere, for display."""


class TriedSearch(Part, frozen=True):
    """A search of the tracker on the frame."""

    what: str
    """Its words: `left arm` for a search of that limb."""
    before_nats: float
    """Cost before it, up to a constant of its own."""
    after_nats: float | None
    """Cost of the best other pose; null where none was about as good."""
    taken: bool
    """Whether that pose took the place of the one before."""


class ReasonMessage(Message, frozen=True, tag="reason"):
    """Why the pose of the selected person is in doubt, for pages that ask."""

    frame: int
    person: int
    running: bool
    stage: str
    """The kind of work."""
    share: float
    """Share of the work that is done, 0 to 1."""
    message: str
    """Why there is no table; empty where there is one."""
    sentence: str
    """The part and the view that contradict the pose most: `left calf: outside the person in LEFT`."""
    part: int | None
    """Index of that part; null where nothing contradicts the pose clearly."""
    camera: int | None
    """The view; null for all of them together."""
    limbs: tuple[LimbReason, ...]
    """Empty without a table."""
    parts: tuple[PartReason, ...]
    """By part of the person; empty without a table."""
    notes: tuple[str, ...]
    """Sentences on what views cannot show."""
    alternatives: tuple[GhostPose, ...]
    """Poses by which a limb is doubtful, cheapest first. The overlay draws them in this order."""
    tried: tuple[TriedSearch, ...] | None
    """The searches of the tracker on the frame in their order, from the store; null where they are not known."""


class CostMapMessage(Message, frozen=True, tag="cost_map"):
    """The cost over two degrees of freedom around the shown pose, for the page that asked last."""

    person: int
    dofs: tuple[int, int]
    """The horizontal one first."""
    current: tuple[float, float]
    """Their values in the pose, degrees or centimetres."""
    across: tuple[float, ...]
    """Sampled values of the first, ascending."""
    up: tuple[float, ...]
    """Sampled values of the second, ascending."""
    nats: tuple[tuple[float, ...], ...]
    """Costs above that of the pose, a row for each value of the second."""
