"""Run the chamfer tracker on staged evidence."""

from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun


def track(observer, models, start, frames, settings=None, **subjects):
    """The estimates of the first pass; keywords as of `Subjects.of`."""
    run = TrackingRun(observer, Subjects.of(models, **subjects), start, frames)
    return ChamferTracker(settings or TrackSettings()).estimates(run)


def track_back(observer, models, found, settings=None, **subjects):
    """The steps of the backward pass; keywords as of `Subjects.of`."""
    run = TrackingRun(observer, Subjects.of(models, **subjects), (), ())
    return ChamferTracker(settings or TrackSettings()).backward_pass(run, found)
