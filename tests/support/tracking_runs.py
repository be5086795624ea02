"""Run trackers on staged evidence, the chamfer tracker by default."""

from tracker.pipeline.methods import make_tracker
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun


def track(observer, models, start, frames, settings=None, **subjects):
    """The estimates of the first pass; keywords as of `Subjects.of`."""
    run = TrackingRun(observer, Subjects.of(models, **subjects), start, frames)
    return make_tracker(settings or TrackSettings()).estimates(run)
