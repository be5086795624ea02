"""Headers of binary messages from the program to the page: the one declaration of their types and fields.

A binary message is `[uint32 length of the header][header: JSON, UTF-8][payload]`, numbers in little-endian order. The
docstring of each header describes its payload.
"""

from typing import Literal, TypeAlias, Union, get_args

from app.drawing.curves import CurveGroup
from app.drawing.joint_handles import Handle, HeadCircle, OutOfReach, Side
from app.drawing.overlays import PathKind
from app.drawing.pin_marks import PinMark, PinTriangulation
from app.messages.base import Message, Part, Status
from app.state.page_view import PictureLayer


class ImageHeader(Message, frozen=True, tag="image"):
    """One picture of a set, covering the whole undistorted image. Payload: JPEG or PNG."""

    layer: PictureLayer
    camera: int
    frame: int
    set: int
    """Number of the set; the page shows the pictures of a set together."""
    of: int
    """Number of pictures in the set."""
    limit_px: float | None
    """Distance at which the distance image is darkest, image pixels; null for other layers."""


class Path(Part, frozen=True):
    """Line segments of one kind: `first` to `first + count` of the payload."""

    camera: int
    person: int
    kind: PathKind
    color: str
    side: Side
    """Side of the body that the lines belong to; empty for its middle and for lines of no body."""
    first: int
    count: int


class Outline(Part, frozen=True):
    """Convex closed outline of a part that can be dragged by its surface; segments as in a path."""

    camera: int
    person: int
    part: int
    depth: float
    """Distance, metres: where outlines overlap, the nearest counts."""
    first: int
    count: int


class OverlayHeader(Message, frozen=True, tag="overlay"):
    """All vectors over the views; replaces the previous overlay. Payload: float32 `x0, y0, x1, y1` per segment."""

    frame: int
    seq: int
    """The last drag message of this page that the overlay includes; 0 before any."""
    job: bool
    """Whether a search drew it."""
    paths: tuple[Path, ...]
    outlines: tuple[Outline, ...]
    handles: tuple[Handle, ...]
    heads: tuple[HeadCircle, ...]
    """Empty unless the page blurs faces."""
    out_of_reach: OutOfReach | None
    """Null while the dragged point follows the pointer."""
    pins: tuple[PinMark, ...]
    triangulation: PinTriangulation | None
    """Of the pins of the joint worked on."""


class CellsHeader(Message, frozen=True, tag="cells"):
    """More than 2,000 cells of the timeline, as columns.

    Payload, `count` values each: uint32 frames, ascending; float32 costs, NaN for null; uint8 indices into `sources`
    (255: no pose); uint8 indices into `statuses`; uint8 marks: 1 for a keyframe, 2 reviewed, 4 ambiguous.
    """

    person: int | None
    replace: bool
    count: int
    sources: tuple[str, ...]
    statuses: tuple[Status, ...]
    remarks: dict[str, str]
    """By frame."""
    limbs_lost: dict[str, tuple[float, ...]]
    """By frame, as in a cell."""


class Plot(Part, frozen=True):
    """Curves that share an axis."""

    title: str
    unit: Literal["deg", "cm", "px"]
    labels: tuple[str, ...]
    """Names of the curves."""
    dofs: tuple[int, ...]
    """Degree of freedom of each curve; empty for costs."""


class CurvesHeader(Message, frozen=True, tag="curves"):
    """A group of curves: whole at first, then the frames that changed; only for subscribed pages.

    Payload: `count` uint32 frames, ascending; then `count` float32 per curve, plot by plot, NaN where there is no pose.
    Angles are as stored; the page unwraps them.
    """

    group: CurveGroup
    person: int
    replace: bool
    """Whether all other frames have no pose."""
    count: int
    plots: tuple[Plot, ...]


class SearchStepsHeader(Message, frozen=True, tag="search_steps"):
    """Recorded steps of a run from `first` on, replacing those known from there.

    Payload, `count` float32 each: evaluations, cost of the candidate, least cost, index of the stage.
    """

    run: int
    first: int
    count: int


class SearchCandidatesHeader(Message, frozen=True, tag="search_candidates"):
    """Best poses of a run as points in all views.

    Payload: float32 `u, v` by candidate, view and point of all people; NaN behind a camera.
    """

    run: int
    costs_px: tuple[float | None, ...]
    points: tuple[int, ...]
    """Number of points of each person."""
    clearest_view: int
    """The view in which the candidates differ most."""


class LandscapeHeader(Message, frozen=True, tag="landscape"):
    """The cost along one degree of freedom.

    Payload, `count` float32 each: values, mean costs, then the costs of each view.
    """

    person: int
    dof: int
    names: tuple[str, ...]
    """Names of the person's degrees of freedom."""
    unit: Literal["rad", "m"]
    current: float
    """Value in the pose."""
    current_px: float | None
    """Cost of the pose."""
    count: int


BinaryHeader: TypeAlias = Union[  # noqa: UP007
    ImageHeader, OverlayHeader, CellsHeader, CurvesHeader, SearchStepsHeader, SearchCandidatesHeader, LandscapeHeader
]  # fmt: skip

BINARY_HEADERS: tuple[type[Message], ...] = get_args(BinaryHeader)
