"""The estimate of one person's pose in one frame: what every tracker returns."""

from typing import NamedTuple

from tracker.geometry.arrays import Array
from tracker.tracking.confidence import Quality, Status


class OtherPose(NamedTuple):
    """A pose of a person that the evidence goes as well with."""

    values: Array
    """Pose, (n_values,)."""
    cost_px: float
    """What `PoseEstimate.cost_px` would be, px; where two people may be exchanged, with both exchanged."""


class PoseEstimate(NamedTuple):
    """Poses found on one frame."""

    frame: int
    poses: tuple[Array, ...]
    """Pose of each person, (n_values,) each."""
    cost_px: float
    """Cost of the poses against all edges near them, px of the footage."""
    views_px: Array
    """The same for each view, (V,); NaN for a view without edges."""
    evaluations: int
    """Poses that the best-first search scored to find them."""
    statuses: tuple[Status, ...]
    """How sure the tracker is of each person."""
    remarks: tuple[str, ...]
    """What was out of the ordinary with each person; empty where nothing was."""
    parts_px: tuple[Array, ...]
    """Mean distance of the contour of each person's parts to the edges, (n_parts,) each, px; NaN where hidden."""
    covariances: tuple[Array, ...]
    """Covariance of each pose, (n_dofs, n_dofs) each, rad and metres; of a pose that was given, zero."""
    qualities: tuple[Quality | None, ...]
    """What the statuses were judged by; None for a pose that was given."""
    alternatives: tuple[tuple[OtherPose, ...], ...]
    """Of each person poses that are about as good, best first; where there are any, the status is at most doubtful."""
