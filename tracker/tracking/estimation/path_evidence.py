"""The evidence of a run's frames for the poses of its people, around poses that are known by now."""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import cache

from tracker.appearance.region_learning import LearningFrame, learn_regions, learning_frames
from tracker.appearance.region_model import RegionModel
from tracker.appearance.region_residuals import region_residuals
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence, with_colors_only
from tracker.fitting.gauss_newton import ResidualBlock
from tracker.tracking.estimation.frame_problem import Bodies
from tracker.tracking.estimation.pose_score import common_evidence, without_prediction
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.tracker import BodiesByFrame, PathEvidence
from tracker.trajectory.solve import FRAMES_AT_ONCE


def evidence_of_frames(
    observer: Observer, bodies: Callable[[], BodiesByFrame], settings: EstimationSettings
) -> PathEvidence:
    """Return contours, key points, colors of the run, and what is known of every frame; see `Tracker.evidence`."""
    seen: OrderedDict[int, tuple[ViewEvidence, ...]] = OrderedDict()

    @cache
    def known() -> dict[int, Bodies]:
        return {frame: tuple(of_people) for frame, of_people in bodies().items()}

    def views(frame: int) -> tuple[ViewEvidence, ...]:
        if frame not in seen:
            seen[frame] = common_evidence(observer, frame, [known()[frame]], settings)
            if len(seen) > FRAMES_AT_ONCE:
                seen.popitem(last=False)
        return seen[frame]

    @cache
    def colors() -> RegionModel:
        frames = learning_frames(sorted(known()))
        learnt = [LearningFrame(tuple(map(with_colors_only, views(k))), known()[k]) for k in frames]
        return learn_regions(learnt, observer.working_cameras, observer.empty_scenes())

    def blocks(frame: int, person: int) -> Sequence[ResidualBlock]:
        if frame not in known():
            return ()
        here, shown = known()[frame], views(frame)
        residuals, priors = without_prediction(shown, here, person, settings)
        return [residuals, *priors, region_residuals(colors(), colors().frame(shown, here), here, person)]

    return blocks
