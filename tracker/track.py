"""The chamfer tracker of GD96: predict, observe, search, one frame at a time.

So far the prediction is the pose of the frame before.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from tracker.body import Body, BodyModel
from tracker.chamfer import ChamferCost, Outliers
from tracker.evidence import Observer, ViewEvidence
from tracker.rigid import Array
from tracker.search import SearchSettings, SearchStep, search


@dataclass(frozen=True)
class TrackSettings:
    """What the chamfer tracker is told."""

    search: SearchSettings = field(default_factory=SearchSettings)
    """Bounds, steps and stopping rule of the search."""
    theta_px: float | None = None
    """Outlier distance, px of the footage; None for 3% of the longer side of each image."""
    outliers: Outliers = "truncated"
    """How outliers are treated, see `ChamferCost`."""


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
    """Poses scored to find them."""


def pose_cost(
    views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array], settings: TrackSettings
) -> ChamferCost:
    """Make the cost function around given poses: what a search from them minimizes."""
    bodies = [Body(m, p) for m, p in zip(models, poses, strict=True)]
    return ChamferCost(views, bodies, settings.theta_px, settings.outliers)


def search_frame(
    views: Sequence[ViewEvidence],
    models: Sequence[BodyModel],
    predicted: Sequence[Array],
    settings: TrackSettings,
    people: Sequence[int] | None = None,
) -> Iterator[SearchStep]:
    """Search the poses of one frame from their prediction, step by step; see `search`."""
    cost = pose_cost(views, models, predicted, settings)
    return search(cost, predicted, settings.search, people)


def track_chamfer(
    observer: Observer,
    models: Sequence[BodyModel],
    start: Sequence[Array],
    frames: Sequence[int],
    settings: TrackSettings,
    fixed: dict[int, dict[int, Array]] | None = None,
    people: Sequence[int] | None = None,
) -> Iterator[PoseEstimate]:
    """Track all people frame by frame.

    Args:
        observer: gives the evidence of a frame.
        models: the body of each person.
        start: pose of each person from which the first frame is searched, (n_values,) each.
        frames: the frames in the order of tracking.
        settings: of the search.
        fixed: poses that stay as they are (keyframes), by frame and person; tracking goes on from them.
        people: whom to track; everybody by default. The others stand as they are in `start` or `fixed`.

    Yields:
        The poses of each frame.
    """
    everybody = range(len(models)) if people is None else people
    poses = list(start)
    for frame in frames:
        held = (fixed or {}).get(frame, {})
        poses = [held.get(i, p) for i, p in enumerate(poses)]
        searched = [i for i in everybody if i not in held]
        views = observer.evidence(frame)
        evaluations = 0
        for step in search_frame(views, models, poses, settings, searched):
            poses, evaluations = list(step.best), step.evaluations
        cost = pose_cost(views, models, poses, settings)(poses)
        yield PoseEstimate(frame, tuple(poses), cost.total_px, cost.views_px, evaluations)
