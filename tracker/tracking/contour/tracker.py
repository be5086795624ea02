"""The contour tracker of KRH08 behind the interface that all trackers share."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from tracker.evidence.observer import Observer
from tracker.tracking.contour.frame_estimator import ContourEstimator
from tracker.tracking.contour.settings import ContourSettings
from tracker.tracking.estimate import BackwardStep, PoseEstimate, TrackedFrame
from tracker.tracking.estimation.backward_pass import track_backward
from tracker.tracking.estimation.forward_pass import track_forward
from tracker.tracking.estimation.path_evidence import evidence_of_frames
from tracker.tracking.tracker import BodiesByFrame, PathEvidence, TrackingRun


@dataclass(frozen=True)
class ContourTracker:
    """Predict, observe, minimize and assess, one frame at a time; then track back through lost intervals."""

    settings: ContourSettings = field(default_factory=ContourSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        return track_forward(run, self.settings, ContourEstimator)

    def backward_pass(self, run: TrackingRun, tracked: Sequence[TrackedFrame]) -> Iterator[BackwardStep]:
        """See `Tracker.backward_pass`; nothing where the settings switch it off."""
        if not self.settings.backward_pass:
            return iter(())
        return track_backward(run, tracked, self.settings, ContourEstimator)

    def evidence(self, observer: Observer, bodies: Callable[[], BodiesByFrame]) -> PathEvidence:
        """See `Tracker.evidence`."""
        return evidence_of_frames(observer, bodies, self.settings)
