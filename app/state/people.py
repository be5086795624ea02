"""How people are shown and handled: their poses, a drag, a draft of sizes, who is visible."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from app.state.progress import WorkState
from tracker.body.limbs import Search
from tracker.body.model import BodyModel
from tracker.body.motion.keyframe_doubts import RaisedView
from tracker.estimation.posing.placed_depth import UndeterminedDepth
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation


@dataclass(frozen=True, eq=False)
class ShownPose:
    """The pose of one person on the shown frame."""

    values: Array
    """Pose, (n_values,)."""
    source: str | None
    """Its origin; None for a draft that is not stored: the pose of the nearest frame that has one."""
    status: str = ""
    """The tracker's assessment: `good`, `doubtful`, `lost`, or empty."""
    remark: str = ""
    """Note of the tracker about the frame, as text for the user."""
    part_costs_px: tuple[float | None, ...] = ()
    """Cost of each part, px; None for an unseen part, empty where unknown."""
    sources: tuple[str, ...] = ()
    """Source of each value of a pose that is not stored yet, (n_values,), where '' keeps the stored one; empty if
    `source` applies to the values that changed."""
    revision: int | None = None
    """Model revision of a stored pose; None for a pose that is not stored as shown."""
    alternatives: tuple[Array, ...] = ()
    """Alternatives that the tracker found, (n_values,) each, best first; empty for a keyframe."""
    seen: tuple[PointObservation, ...] = ()
    """Positions of points that the user has just placed in a view, to be stored with the pose."""
    errors: Array | None = None
    """Covariance of each point of a stored pose, (n_points, 3, 3), m^2; None where not known, as after an edit."""
    trace: tuple[Search, ...] | None = None
    """The tracker's searches on the frame; None where they are not known, as after an edit."""

    @property
    def expected_errors_m(self) -> Array:
        """Expected error of each point, root mean square, (n_points,), metres; empty where not known."""
        return np.zeros(0) if self.errors is None else np.sqrt(np.trace(self.errors, axis1=1, axis2=2))


def is_same_pose(before: ShownPose, now: ShownPose) -> bool:
    """Return whether a stored pose is still as it was shown; one that was just saved has no revision yet."""
    return (
        (before.source, before.status, before.remark) == (now.source, now.status, now.remark)
        and before.revision in (None, now.revision)
        and np.array_equal(before.values, now.values)
    )


@dataclass(frozen=True)
class DragState:
    """A drag of a point or of a part."""

    camera: int
    person: int
    point: str
    """Name of the point, or of the part if its surface is dragged."""
    pointer_px: tuple[float, float]
    """Undistorted px."""
    part: int
    """Index of the part that carries the dragged place."""
    place_part: tuple[float, float, float]
    """The dragged place in the frame of its part, metres."""
    by_surface: bool = False
    """Whether the surface of the part is dragged, not a point."""
    mode: str = "move"
    """`move`, `turn`, `push` or `bend`, see `tracker.estimation.posing.drag`."""
    short_m: float = 0.0
    """Distance between the dragged place and the line of sight that it should be on, metres."""
    wanted_px: tuple[float, float] | None = None
    """Position of the pointer in the view, undistorted px; None before the first move."""


class HeldPoint(NamedTuple):
    """A point that was placed by hand, and that stays in place while others are dragged."""

    frame: int
    person: int
    """Index of the person."""
    point: str
    """Name of the point."""
    camera: int | None
    """Index of a view in which it was placed; None where it was held by command."""


@dataclass(frozen=True, eq=False)
class DepthNote:
    """Points placed in opposite or neighbouring views alone. It holds as long as the pose is shown unchanged."""

    frame: int
    person: int
    """Index of the person."""
    values: Array
    """The pose, (n_values,)."""
    unseen: UndeterminedDepth


class KeyframeDoubt(NamedTuple):
    """A keyframe that its neighbours or views contradict, or tracks that have not seen it."""

    person: int
    """Index of the person."""
    frame: int
    distance_m: float | None
    """Distance from the motion of its neighbours, metres; None if they agree with it."""
    point: str
    """Name of the farthest point, for display; empty if they agree."""
    views: tuple[RaisedView, ...]
    """Views whose cost is raised, most raised first."""
    reason: str = ""
    """Why a program that assessed it finds it doubtful or lost; empty if none does."""


@dataclass(frozen=True, eq=False)
class SizeDraft:
    """Body sizes of a person that are being edited and are not applied yet."""

    person: int
    model: BodyModel
    """The body with these sizes."""
    poses: Mapping[int, Array] = field(default_factory=dict)
    """By frame, known poses of this body, (n_values,); empty for sizes that were typed."""


Line = tuple[float, float, float, float]
"""x0, y0, x1, y1."""


@dataclass(frozen=True)
class SideOutlines:
    """Outlines of two bodies from one side, pixels of a picture of `size_px`: x0, y0, x1, y1 of short lines."""

    before: tuple[Line, ...]
    after: tuple[Line, ...]


@dataclass(frozen=True)
class BodyOutlines:
    """Outlines of two bodies."""

    size_px: tuple[int, int]
    """Width and height of each picture."""
    front: SideOutlines
    side: SideOutlines


@dataclass(frozen=True)
class AcquiredSize:
    """One size of a body before and after an acquisition, metres."""

    name: str
    """As text for the user."""
    before_m: float
    after_m: float
    sigma_m: float
    """Standard deviation of the size after the acquisition, metres."""


@dataclass(frozen=True)
class AcquisitionState(WorkState):
    """An acquisition of sizes from the footage. Its message says why there is no result, or what that does not show."""

    person: int = 0
    """Index of the person whose sizes are acquired."""
    frames: tuple[int, ...] = ()
    """Frames that the sizes were fitted to; empty without a result."""
    cost_before_px: float = 0.0
    """Mean cost over these frames with the body before, px."""
    cost_after_px: float = 0.0
    """The same with the acquired body, px."""
    sizes: tuple[AcquiredSize, ...] = ()
    """All sizes, those that changed most first."""
    outlines: BodyOutlines | None = None
    """Both bodies from the front and from the side; None without a result."""


@dataclass(frozen=True)
class Visibility:
    """Which people the views show. Poses are unaffected: a hidden person still occludes others and counts in costs."""

    hidden: frozenset[int] = frozenset()
    """Indices of the people that no view shows."""
    solo: bool = False
    """Whether all people but the selected one are dimmed and cannot be dragged."""
