"""The poses of a range against those that they replaced, as a page shows them (docs/protocol.md)."""

from app.page.message_types import Message, Part
from app.state.comparison import RangeComparison


class ComparedPose(Part, frozen=True):
    """The pose of a person in a frame, against the pose that it replaced."""

    frame: int
    method: str
    """Method of the tracker, or the source of the values."""
    other_method: str
    cost_px: float | None
    other_cost_px: float | None
    status: str
    """As its tracker assessed it; empty if none did."""
    other_status: str
    apart_mm: float
    """Mean distance between the joints of both poses."""
    farthest_mm: float
    """Largest of these distances."""
    farthest: str
    """Name of that joint, for display."""


class RangeComparisonMessage(Message, frozen=True, tag="range_comparison"):
    """The poses of a range against those that they replaced."""

    first: int | None
    """Null while nothing is compared."""
    last: int | None
    people: tuple[tuple[ComparedPose, ...], ...]
    """By person; frames whose pose replaced none are left out."""


def range_comparison(found: RangeComparison | None) -> RangeComparisonMessage:
    """Describe the poses of a range against those that they replaced."""
    if found is None:
        return RangeComparisonMessage(None, None, ())
    people = (
        tuple(
            ComparedPose(
                f.frame, f.method, f.other_method, f.cost_px, f.other_cost_px, f.status, f.other_status,
                1000 * f.apart_m, 1000 * f.farthest_m, f.farthest,
            )
            for f in of_person
        )
        for of_person in found.frames
    )  # fmt: skip
    return RangeComparisonMessage(found.first, found.last, tuple(people))
