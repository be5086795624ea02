"""The voxel tracker of MTHC01 behind the interface that all trackers share."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field

from tracker.estimation.tracking.tracker import PoseEstimate, TrackingRun
from tracker.estimation.voxel.frame_estimator import VoxelEstimator
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.evidence.silhouettes import SilhouetteFinder, ViewSilhouette
from tracker.evidence.voxels.shadows import recover_from_shadows


@dataclass(frozen=True)
class VoxelTracker:
    """Predict, carve, label, measure and update, one frame at a time."""

    settings: VoxelSettings = field(default_factory=VoxelSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        of = run.observer
        finder = SilhouetteFinder(of.cameras, of.recording, recording_views=of.recording_views)

        def silhouettes_of(frame: int) -> Sequence[ViewSilhouette]:
            found = finder.silhouettes(frame)
            return found if run.floor is None else recover_from_shadows(found, run.floor, self.settings.voxel_m)

        estimator = VoxelEstimator(run, self.settings)
        with closing(finder), ThreadPoolExecutor(1, "silhouettes ahead") as ahead:
            following = ahead.submit(silhouettes_of, run.frames[0])
            for i, frame in enumerate(run.frames):
                silhouettes = following.result()
                if i + 1 < len(run.frames):
                    following = ahead.submit(silhouettes_of, run.frames[i + 1])
                yield estimator.estimate(frame, silhouettes)
