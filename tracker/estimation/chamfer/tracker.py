"""The chamfer tracker of GD96 behind the interface that all trackers share."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from tracker.estimation.by_frame.forward_pass import track_forward
from tracker.estimation.chamfer.frame_estimator import ChamferEstimator
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import PoseEstimate, TrackingRun


@dataclass(frozen=True)
class ChamferTracker:
    """Predict, observe, estimate and assess, one frame at a time."""

    settings: TrackSettings = field(default_factory=TrackSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        return track_forward(run, self.settings, ChamferEstimator)
