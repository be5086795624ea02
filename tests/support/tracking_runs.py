"""Run trackers on staged evidence, the chamfer tracker by default."""

from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.pipeline.methods import make_tracker


def track(observer, models, start, frames, settings=None, **subjects):
    """The estimates of the first pass; keywords as of `Subjects.of`."""
    run = TrackingRun(observer, Subjects.of(models, **subjects), start, frames)
    return make_tracker(settings or TrackSettings()).estimates(run)
