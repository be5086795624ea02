"""Run trackers on staged evidence, the chamfer tracker by default; sessions with a pose to track from."""

from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.evaluation.references import read_joints
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.pipeline.methods import make_tracker
from tracker.session.assemble import NewSession, assemble


def track(observer, models, start, frames, settings=None, **subjects):
    """The estimates of the first pass; keywords as of `Subjects.of`."""
    run = TrackingRun(observer, Subjects.of(models, **subjects), start, frames)
    return make_tracker(settings or TrackSettings()).estimates(run)


def with_reference(data, folder, joints="ground_truth.trc", sides=(), **options):
    """A session of a recording, its reference, and the pose that is fitted to it on frame 0."""
    more = {side: data / side for side in sides}
    session = assemble(NewSession(folder, data / "Calib.toml", sorted(data.glob("*.mp4")), **more, **options))
    reference = read_joints(data / joints, session.fps)
    places = dict(zip(reference.names, reference.points[0], strict=True))
    return session, reference, fit_to_points(session.people[0].model, {n: places[n] for n in LIMB_JOINTS}).pose
