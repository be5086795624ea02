"""The contour tracker of KRH08 behind the interface that all trackers share."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from tracker.estimation.by_frame.forward_pass import track_forward
from tracker.estimation.contour.frame_estimator import ContourEstimator
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.tracking.tracker import PoseEstimate, TrackingRun


@dataclass(frozen=True)
class ContourTracker:
    """Predict, observe, minimize and assess, one frame at a time."""

    settings: ContourSettings = field(default_factory=ContourSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        return track_forward(run, self.settings, ContourEstimator)
