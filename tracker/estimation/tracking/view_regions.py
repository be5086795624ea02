"""Regions of the views around posed bodies, the evidence there, and visible contours."""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import PosedBody
from tracker.estimation.appearance.region_model import REACH_M
from tracker.evidence.contours.occluding_contours import trace_views
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.images.working_view import region_around
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import FloatArray
from tracker.geometry.cameras import Camera, Region

_MIN_MARGIN_M = 0.19
"""A region chosen ahead is used if at least this margin is left when the frame is predicted again."""


def regions(cameras: Sequence[Camera], bodies: Sequence[PosedBody], margin_m: float = REACH_M) -> list[Region | None]:
    """Return the region around all bodies in each view; None for the whole image."""
    points = np.concatenate([b.points_world for b in bodies])
    out: list[Region | None] = []
    for camera in cameras:
        px, depths = camera.project_with_depths(points)
        if depths.min() < 2 * REACH_M:  # too near for its contour to lie around the joints' images
            out.append(None)
            continue
        margin = margin_m * camera.K[0, 0] / float(np.median(depths))
        out.append(region_around(px, margin, camera.size))
    return out


def confirmed_regions(
    ahead: Sequence[Region | None], cameras: Sequence[Camera], bodies: Sequence[PosedBody]
) -> list[Region | None]:
    """Return the regions that were chosen ahead, but new ones in views where a body comes near the border.

    They depend on poses alone, so that results do not depend on which thread is first.
    """
    required, new = regions(cameras, bodies, _MIN_MARGIN_M), regions(cameras, bodies)
    return [a if _contains(a, small) else r for a, small, r in zip(ahead, required, new, strict=True)]


def _contains(outer: Region | None, inner: Region | None) -> bool:
    """Return whether a region contains another; None is the whole image."""
    if outer is None or inner is None:
        return outer is None
    return all(o <= i for o, i in zip(outer[:2], inner[:2], strict=True)) and all(
        o >= i for o, i in zip(outer[2:], inner[2:], strict=True)
    )


def read_views(
    observer: Observer, frame: int, bodies: Sequence[PosedBody], static_edges: Sequence[StaticEdgeModel] | None = None
) -> tuple[ViewEvidence, ...]:
    """Return the evidence of a frame around all people."""
    where, visible = regions(observer.working_cameras, bodies), accepting_pieces_px(observer, frame, [bodies])
    return observer.evidence(frame, where, visible, static_edges)


def accepting_pieces_px(observer: Observer, frame: int, guesses: Sequence[Sequence[PosedBody]]) -> list[FloatArray]:
    """Return the visible pieces of several guesses of all people in each view, at the time of its picture.

    They are x0, y0, x1, y1, (M, 4), px of the working cameras.
    """
    cameras, times = observer.working_cameras, observer.ahead_frames(frame)
    of_guesses = [trace_views(g, cameras, times) for g in guesses]
    return [np.concatenate([c.pieces_px[~c.occluded] for c in of_view]) for of_view in zip(*of_guesses, strict=True)]
