"""First poses that other evidence shows, fitted to the contours and tracked over a few frames."""

from collections.abc import Callable

from tracker.estimation.initialization.first_pose import FirstPoses
from tracker.estimation.initialization.own_figure import others_on_frame
from tracker.estimation.initialization.start_fit import StartFitter, short_tracks
from tracker.evidence.observer import Observer
from tracker.session.session import Session


def fit_to_contours(
    session: Session, observer: Observer, found: FirstPoses, step: Callable[[], None] = lambda: None
) -> FirstPoses:
    """Fit first poses to the contours of their frame, one person after the other.

    A person whose fit is not good, or who is lost on a short track from there, keeps the pose: contours in clutter lead
    it away.

    Args:
        session: the session; nothing is stored.
        observer: of its recording.
        found: the first poses.
        step: called after each frame that is fitted. An exception that it raises ends the work.
    """
    poses = dict(found.poses)
    for person, first in found.poses.items():
        others = others_on_frame(session, person, found.frame, {i: p.start.body for i, p in poses.items()})
        fitter = StartFitter(observer, found.frame, short_tracks(found.frame, session.n_frames), tuple(others), step)
        track = fitter.track(first.start)
        if track.status == "good" and not track.is_lost:
            poses[person] = first._replace(start=track.start, status=track.status, cost_px=track.cost_px)
    return FirstPoses(found.frame, poses)
