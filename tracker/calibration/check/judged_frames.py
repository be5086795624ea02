"""Frames from which cameras are judged: what the views show there, and which of it the present cameras accept."""

from collections.abc import Sequence
from typing import NamedTuple

from tracker.body.model import PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.estimation.acquisition.contour_bundle import RigState, SeenPerson, later
from tracker.estimation.acquisition.from_contours import own_views
from tracker.evidence.contours import occluding_contours
from tracker.evidence.images.edge_segments import accept_segments
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence, with_all_segments, with_segments
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import corrected, later_s


class JudgedFrame(NamedTuple):
    """People on a frame, and all that the views show around them."""

    frame: int
    views: tuple[ViewEvidence, ...]
    """With their segments."""
    bodies: tuple[PosedBody, ...]
    """All people, as they were tracked."""
    paths: tuple[PosePath, ...]
    """Way of each person's pose around the frame."""
    time_s: float
    """Time of the frame, seconds, since that to which drifts are related."""
    ahead_s: tuple[float, ...]
    """Time by which the picture of each view was taken later than the frame, by the present clocks, seconds."""


def seen_people(frames: Sequence[JudgedFrame], state: RigState | None = None) -> list[SeenPerson]:
    """Return the evidence of each person on each frame.

    Args:
        frames: the frames.
        state: cameras and poses by which segments are accepted; None takes all segments that may be a person's.
    """
    out, poses = [], iter(()) if state is None else iter(state.poses)
    for seen in frames:
        bodies = seen.bodies
        if state is None:
            views: Sequence[ViewEvidence] = [with_all_segments(v) for v in seen.views]
        else:
            bodies = tuple(PosedBody(b.model, next(poses)) for b in seen.bodies)
            views = [
                _accepted(view, later(bodies, seen.paths, ahead_s + later_s(c, seen.time_s)), c)
                for view, ahead_s, c in zip(seen.views, seen.ahead_s, state.corrections, strict=True)
            ]
        for person in range(len(bodies)):
            own = own_views(views, bodies, person) if len(bodies) > 1 else views
            out.append(SeenPerson(person, own, bodies, seen.paths, seen.time_s, seen.ahead_s))
    return out


def _accepted(view: ViewEvidence, bodies: Sequence[PosedBody], correction: Array) -> ViewEvidence:
    """Return a view with the segments that the contours of people accept under a corrected camera."""
    if view.segments is None or view.samples is None:
        return view
    contour = occluding_contours.trace(bodies, corrected(view.camera, correction))
    pieces = contour.pieces_px[~contour.occluded]
    chosen = accept_segments(view.samples, pieces, ACCEPTED_SHARE * view.theta_px)
    return with_segments(view, chosen if view.is_static is None else chosen & ~view.is_static)
