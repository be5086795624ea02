"""The search on the shown frame: its progress, how it is watched, and the cost around a pose."""

from dataclasses import dataclass, field

from tracker.geometry.arrays import Array


@dataclass(frozen=True)
class SearchState:
    """The search on the shown frame, running or paused."""

    running: bool = False
    kind: str | None = None
    """`search`, or None if there is no search."""
    stage: str | None = None
    """Name of the current stage."""
    evaluations: int = 0
    """Poses scored since the search began."""
    best_px: float | None = None
    """Lowest cost so far, px."""
    candidate: tuple[Array, ...] | None = field(default=None, compare=False)
    """Pose of each person under test."""
    message: str = ""
    """How the last search ended."""
    failed: bool = False
    """Whether it ended with an error."""


@dataclass(frozen=True, eq=False)
class ReplayState:
    """A recorded step of a search, shown in place of the stored poses."""

    run: int
    """Number of the run."""
    step: int
    """Index among its recorded steps; -1 for its start."""
    steps: int
    """Number of recorded steps."""
    candidate: tuple[Array, ...] | None
    """Pose of each person under test; None at the start."""
    best: tuple[Array, ...]
    """Best pose of each person so far."""
    stage: str | None
    """Name of the current stage; None at the start."""
    candidate_px: float | None
    """Cost of the candidate, px."""
    evaluations: int
    """Poses scored so far."""
    cost_px: float | None
    """Cost of the best poses, px."""
    view_costs_px: tuple[float | None, ...]
    """The same in each view, px; empty where unknown."""
    fitted_from: tuple[Array, ...] | None = None
    """Of a fit of contours the pose of each person at its start; None for a search."""


@dataclass(frozen=True, eq=False)
class PreviewState:
    """A candidate of a search, drawn over the stored poses."""

    run: int
    """Number of the run."""
    candidate: int
    """Index among the best candidates of the run."""
    poses: tuple[Array, ...]
    """Pose of each person."""


@dataclass(frozen=True, eq=False)
class SearchView:
    """How searches are watched: the speed of a running one, and what is drawn of recorded ones."""

    speed: float | None = None
    """Expansions per second; None for full speed."""
    replay: ReplayState | None = None
    preview: PreviewState | None = None
    """The list entry under the pointer."""
    compared: tuple[Array, ...] | None = None
    """Result of another run, drawn over the stored poses."""
    compared_run: int | None = None
    """Number of that run."""


@dataclass(frozen=True, eq=False)
class CostLandscape:
    """The cost over the range of one degree of freedom, all others fixed."""

    person: int
    dof: int
    """Index among the degrees of freedom of the person's body."""
    current: float
    """Its value in the pose, rad or metres."""
    current_px: float
    """Cost of the pose, px."""
    values: Array
    """Sampled values, (N,), ascending, rad or metres."""
    totals_px: Array
    """Costs, (N,), px."""
    view_costs_px: Array
    """Costs in each view, (N, V), px; NaN for views without edges."""


@dataclass(frozen=True, eq=False)
class CostMap:
    """The cost over two degrees of freedom, all others fixed."""

    person: int
    dofs: tuple[int, int]
    """Indices among the degrees of freedom of the person's body, the horizontal one first."""
    current: tuple[float, float]
    """Their values in the pose, rad or metres."""
    across: Array
    """Sampled values of the first, (W,), ascending, rad or metres."""
    up: Array
    """Sampled values of the second, (H,), ascending, rad or metres."""
    nats: Array
    """Costs above that of the pose, (H, W), nats."""
